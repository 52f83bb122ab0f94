"""`python -m sdf2vec`: the same as `sdf2vec`."""

from sdf2vec_start import main

if __name__ == "__main__":
    main()

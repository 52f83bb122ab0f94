"""sdf2vec turns a picture into a few soft geometric shapes and those into shaders and SVG."""

__version__ = "0.1.0"

"""PDFium draws known pixels."""

import numpy as np
import pytest

from sdf2vec.engines import ENGINES, EngineError

PDF_HALF_RED = b"""%PDF-1.4
1 0 obj <</Type/Catalog/Pages 2 0 R>> endobj
2 0 obj <</Type/Pages/Kids[3 0 R]/Count 1>> endobj
3 0 obj <</Type/Page/Parent 2 0 R/MediaBox[0 0 8 4]/Contents 4 0 R
/Resources<</ExtGState<</A <</ca 0.5>>>>>>>> endobj
4 0 obj <</Length 28>> stream
/A gs 1 0 0 rg 0 0 4 2 re f
endstream endobj
trailer <</Root 1 0 R>>
%%EOF"""


class TestPdf:
    def test_straight_alpha_and_rows(self, require_engine):
        require_engine("pdfium")
        pixels = ENGINES["pdfium"].render(PDF_HALF_RED, 16, 8)
        expected = np.zeros((8, 16, 4), np.float32)
        expected[4:, :8] = (1, 0, 0, 0.5)
        assert pixels.dtype == np.float32
        np.testing.assert_allclose(pixels, expected, atol=1 / 128)

    def test_refused(self, require_engine):
        require_engine("pdfium")
        with pytest.raises(EngineError, match="PDFium refuses"):
            ENGINES["pdfium"].render(b"", 4, 4)

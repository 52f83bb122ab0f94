"""PDF drawn by PDFium, which Chromium shows PDF with."""

import numpy as np
import pypdfium2

from sdf2vec.engines.engine import EngineError, Picture


def probe() -> None:
    """Raises where PDFium does not work."""
    pypdfium2.PdfDocument.new().close()


def render(pdf: bytes, width: int, height: int) -> Picture:
    """Draws the first page of a PDF, stretched over `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: the PDF is refused.
    """
    try:
        page = pypdfium2.PdfDocument(pdf)[0]
    except pypdfium2.PdfiumError as error:
        raise EngineError(f"PDFium refuses the PDF: {error}") from None
    bitmap = pypdfium2.PdfBitmap.new_native(width, height, pypdfium2.raw.FPDFBitmap_BGRA)
    bitmap.fill_rect((0, 0, 0, 0), 0, 0, width, height)
    pypdfium2.raw.FPDF_RenderPageBitmap(bitmap, page, 0, 0, width, height, 0, 0)
    levels: Picture = bitmap.to_numpy()[..., [2, 1, 0, 3]].astype(np.float32)
    return levels / np.float32(255)

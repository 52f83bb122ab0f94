"""The exports of a scene, which is converted first for an exporter that doesn't accept it as it is."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING

from msgspec import structs

from .declared import check_choice
from .deferred import deferred
from .export import EXPORTERS, Exporter
from .export.byte_limit import ByteLimit, gzipped_size
from .export.exported import Exported
from .export.options import PICTURE, Options
from .export.rounding import COARSEST, FINEST, Rounded, Rounding
from .grain import DENSE, GRAINS, USUAL, Drawable, Grain, is_few_and_sharp
from .scene import Scene
from .steps import StepsOf

if TYPE_CHECKING:
    from .fit.settling import Views
    from .image import Picture

STROKE, SEVERAL = "arc", 2  # kind; how many
HARDLY, LITTLE = 0.2, 0.5  # dB that a small drawing may lose of the picture: a coarse one, a finer one
LIKE_RENDER_ERROR = 10**-4.2  # mean squared, of what is 42 dB from the render
SAME = 99.0  # dB of what is the same
WORTH = 1.5  # dB that twice the bytes, as they are and gzipped, are to bring: about what twice the shapes do
MOST_LOST = 5.0  # dB of the picture that are lost for fewer bytes, at most
LARGER = 0.7  # of a size limit: where the finest small drawing takes more, others take too much
SURE = (
    0.98  # of a size limit: what keeps within this keeps within the limit when its numbers are fitted again
)
ABOUT = 1.03  # of a size limit, that a drawing which is still to be fitted may seem to take

WASTED = 0.15  # dB that rounded numbers may lose of the picture
USUAL_NEAR = 44.0  # dB from the render, where nobody knows how near that is to a picture
GAINED, GAINED_ALONE = 5.0, 2.0  # dB, about, that fitting again to a picture brings, and to the render
STEP = 1.0  # dB between two tries of rounded numbers
TRIES = 3
COARSER = 1.0  # dB, than where hardly anything is lost: more shapes so coarse say more than fewer finer ones
DENSEST = 30.0  # dB from the render, the same where the picture is not known

Phase = Callable[[str], AbstractContextManager[object]]

_drawable: Callable[[Scene, Views, Grain, Scene | None], Drawable] = deferred(
    "sdf2vec.fit.drawable", "drawable"
)
_blurred: Callable[[Scene, Views, Grain], Drawable] = deferred("sdf2vec.fit.drawable", "blurred")
_rounded: Callable[[Scene, Grain], Drawable] = deferred("sdf2vec.fit.drawable", "rounded")
_settled: Callable[[Scene, StepsOf, Views], Scene] = deferred("sdf2vec.fit.settling", "settled")
_views_of: Callable[[Picture], Views] = deferred("sdf2vec.fit.settling", "views_of")
_picture_of: Callable[[Scene], Picture] = deferred("sdf2vec.fit.conversion", "picture_of")
_psnr_of: Callable[[Scene, Picture], float] = deferred("sdf2vec.quality", "psnr_of")
_psnr_of_drawable: Callable[[Drawable, Picture], float] = deferred("sdf2vec.quality", "psnr_of_drawable")
_over_of: Callable[[Scene], tuple[Scene, float]] = deferred("sdf2vec.fit.conversion", "over_of")


class Exports:
    """The exports of one scene, fitted to a picture if that is given, else to what its render shows.

    What several need of it is fitted again once: the scene under `over`, and one that a small drawing can say.
    `phase`: entered with the name of such a fit while it goes on.
    """

    def __init__(
        self,
        scene: Scene,
        picture: Picture | None = None,
        phase: Phase | None = None,
    ) -> None:
        self.scene, self.picture, self._phase = scene, picture, phase or nullcontext
        self._drawn, self._near = cache(self._fit_small), cache(self._psnr)

    def export(self, target: str, options: Options | None = None) -> Exported:
        """One export. Raises Sdf2vecError for an unknown target and for what the exporter can't do."""
        check_choice("target", target, EXPORTERS)
        exporter, options = EXPORTERS[target], options or Options()
        exporter.check_count(self.scene.shape_count, options)
        refusal = exporter.accepts(options).refusal(self.scene)
        if not refusal:
            return self._made(exporter, self.scene, options)
        scene, decibels = self._over
        near = f" ({decibels:.1f} dB from its render)" if scene.layers else ""
        note = f"{target}: nothing can be added up {refusal}: fitted again under over{near}"
        made = self._made(exporter, scene, options)
        return replace(made, notes=(note, *made.notes))

    def drawn(self, grain: Grain) -> Drawable:
        """What a small drawing of this grain can say that is nearest to the picture."""
        return self._drawn(self.scene, grain)

    def densest(self, target: str, options: Options) -> Exported:
        """The form of one export that says most with few bytes, about: its numbers are rounded, not fitted again."""
        exporter = EXPORTERS[target]
        scene = self._over[0] if exporter.accepts(options).refusal(self.scene) else self.scene
        if exporter.sketch and exporter.draws(scene, options):
            return exporter.sketch(_rounded(scene, DENSE), options, DENSE)
        rounding = exporter.rounding(scene, options)
        aim = self._aim(scene) - COARSER if self.picture else DENSEST
        return rounding(aim).write(scene)[0] if rounding else exporter.from_finest(scene, options)[-1]()

    def sketched(self, target: str, options: Options) -> Exported:
        """One export, about as large as it would be: its numbers are rounded, not fitted again."""
        if options.max_bytes is not None:
            return self.densest(target, options)
        exporter = EXPORTERS[target]
        scene = self._over[0] if exporter.accepts(options).refusal(self.scene) else self.scene
        is_small = options.svg_fidelity == PICTURE and not _is_plain(scene)
        if exporter.holds_drawing and is_small:
            drawing = self.sketched("svg", Options(title=options.title, alt=options.alt))
            options = structs.replace(options, drawing=str(drawing.data))
        if exporter.sketch and is_small and exporter.draws(scene, options):
            return exporter.sketch(_rounded(scene, USUAL[0]), options, USUAL[0])
        if rounding := self._rounding(exporter, scene, options):
            return rounding(self._aim(scene)).write(scene)[0]
        return exporter.from_finest(scene, options)[0]()

    @cached_property
    def _over(self) -> tuple[Scene, float]:
        with self._phase("fit under over"):
            return _over_of(self.scene)

    def _made(self, exporter: Exporter, scene: Scene, options: Options) -> Exported:
        """The finest that keeps to the size limit; where none does, the smallest."""
        if exporter.holds_drawing:
            small = self._near_enough(EXPORTERS["svg"], scene, Options(title=options.title, alt=options.alt))
            options = structs.replace(options, drawing=str(small.data) if small else "")
        if options.max_bytes is None:
            return next(self._unlimited(exporter, scene, options))
        limit, tried = ByteLimit.of(options.max_bytes), []
        for make in self._from_finest(exporter, scene, options, limit):
            tried.append(make())
            if limit.share(tried[-1].raw) <= 1:
                return tried[-1]
        made = min(tried, key=lambda form: limit.size(form.raw))
        name, size = exporter.suffix[1:], limit.size(made.raw)
        much = f"{name}: {size:,} bytes at least, more than the limit of {limit}; fit fewer shapes, or --shapes auto"
        return replace(made, notes=(*made.notes, much), met=False)

    def _unlimited(self, exporter: Exporter, scene: Scene, options: Options) -> Iterator[Exported]:
        """What there is where no size is asked for, best first."""
        if small := self._near_enough(exporter, scene, options):
            yield small
        if rounding := self._rounding(exporter, scene, options):
            yield self._rounded_near(exporter, rounding, scene)
        yield exporter.from_finest(scene, options)[0]()

    def _near_enough(self, exporter: Exporter, scene: Scene, options: Options) -> Exported | None:
        """The smallest drawing that loses hardly anything of the picture; where all lose more, the finest of them or
        one like the render, whichever says more with its bytes.
        """
        wanted = options.svg_fidelity == PICTURE and self.picture is not None
        if not wanted or not (exporter.draw and exporter.draws(scene, options)):
            return None
        if _is_plain(scene) or (_mixes_colors(scene) and self._loses_more(exporter, scene, options)):
            return None
        for grain in USUAL:
            drawn, most = self._drawn(scene, grain), self._most_lost(scene, grain)
            if self._lost_by(scene, drawn.scene) > most and grain is not USUAL[-1]:
                continue
            made = exporter.draw(drawn, options, grain)
            lost = self._lost_by(scene, drawn.scene, (made.error / 255) ** 2)
            if lost <= most:
                break
        else:
            like = exporter.from_finest(scene, options)[0]()
            gained = lost - self._lost_by(scene, scene, LIKE_RENDER_ERROR)
            if lost > MOST_LOST or gained >= WORTH * _doublings(made.raw, like.raw):
                return like
        note = f"{exporter.suffix[1:]}: drawn small, {self._told(scene, lost)}"
        return replace(made, notes=(note, *made.notes))

    def _told(self, scene: Scene, lost: float) -> str:
        """What a drawing loses of the picture; where that is much because the scene is so near, what it comes to."""
        return _lost(lost) if lost <= LITTLE else f"{self._near(scene) - lost:.1f} dB from the picture"

    def _loses_more(self, exporter: Exporter, scene: Scene, options: Options) -> bool:
        """Whether the finest small drawing loses more than it may, which no fit would mend."""
        assert exporter.draw is not None
        made = exporter.draw(_rounded(scene, USUAL[-1]), options, USUAL[-1])
        return self._lost_by(scene, scene, (made.error / 255) ** 2) > self._most_lost(scene, USUAL[-1])

    def _most_lost(self, scene: Scene, grain: Grain) -> float:
        """How many dB of the picture a small drawing may lose: the finest, as many as one like the render."""
        if grain is not USUAL[-1]:
            return HARDLY if grain is USUAL[0] else LITTLE
        return max(LITTLE, self._lost_by(scene, scene, LIKE_RENDER_ERROR))

    def _lost_by(self, scene: Scene, found: Scene, error: float = 0.0) -> float:
        """How many dB of the picture another scene loses whose mean squared error is larger by so much."""
        return self._near(scene) + 10 * math.log10(max(10 ** (-self._near(found) / 10) + error, 1e-12))

    def _from_finest(
        self, exporter: Exporter, scene: Scene, options: Options, limit: ByteLimit
    ) -> Iterator[Callable[[], Exported]]:
        """What may keep to a size limit."""
        draw = exporter.draw if exporter.draw and exporter.draws(scene, options) else None
        if draw is None:
            yield from self._coarser(exporter, scene, options, limit)
            return

        @cache
        def share_of(grain: Grain) -> float:
            assert exporter.sketch is not None
            return limit.share(exporter.sketch(_rounded(scene, grain), options, grain).raw)

        def may_fit(grain: Grain) -> bool:
            # runs are fitted anew each, which takes long: none that may turn out too large
            return share_of(grain) <= (1.0 if grain.runs else ABOUT)

        near = self._near_enough(exporter, scene, options) if may_fit(USUAL[0]) else None
        if near:
            yield lambda: near
        elif share_of(GRAINS[0]) <= LARGER:
            yield from exporter.from_finest(scene, options)
        for grain in GRAINS:
            if grain is GRAINS[-1] or may_fit(grain):
                yield partial(self._draw_small, draw, scene, options, grain)

    def _draw_small(
        self,
        draw: Callable[[Drawable, Options, Grain], Exported],
        scene: Scene,
        options: Options,
        grain: Grain,
    ) -> Exported:
        made = draw(self._drawn(scene, grain), options, grain)
        blurs = ", layers blurred together" if grain.runs else ""
        units = grain.for_scene(scene).units
        note = f"drawn small: {units} steps along the shortest side, {grain.colors} of a colour{blurs}"
        return replace(made, notes=(note, *made.notes))

    def _fit_small(self, scene: Scene, grain: Grain) -> Drawable:
        """What a drawing of this grain can say that is nearest to the picture."""
        coarser = self._drawn(scene, USUAL[0]).scene if grain in USUAL[1:] else None
        if coarser and self._lost_by(scene, coarser) > LITTLE:
            coarser = None
        with self._phase("fit drawing"):
            return _drawable(scene, self._views, grain, coarser)

    # --- rounded numbers ------------------------------------------------------------------------------------------

    def _rounding(self, exporter: Exporter, scene: Scene, options: Options) -> Rounding | None:
        """How an export of rounded numbers is made, where it may be one or can be nothing else."""
        near = self.picture is not None and options.svg_fidelity == PICTURE
        may = near or options.max_bytes is not None or not exporter.forms
        return exporter.rounding(scene, options) if may else None

    def _rounded_near(self, exporter: Exporter, rounding: Rounding, scene: Scene) -> Exported:
        """The smallest that loses hardly anything of the picture; where none is found, the nearest."""
        aim = self._aim(scene)
        enough = -10 * math.log10(max(10 ** (-self._near(scene) / 10) + self._allowed(scene), 1e-12))
        best = (Exported(""), -math.inf)
        for _ in range(TRIES):
            best = max(
                best, self._fit_rounded(exporter, rounding(aim), scene, enough), key=lambda found: found[1]
            )
            if best[1] >= enough or aim >= FINEST:
                break
            aim = min(aim + STEP, FINEST)
        return best[0]

    def _coarser(
        self, exporter: Exporter, scene: Scene, options: Options, limit: ByteLimit
    ) -> Iterator[Callable[[], Exported]]:
        """What may keep to a size limit: all forms, then ever coarser numbers."""
        if exporter.forms:
            yield from exporter.from_finest(scene, options)
        rounding = self._rounding(exporter, scene, options)
        if rounding is None:
            if not exporter.forms:
                yield from exporter.from_finest(scene, options)
            return
        first = FINEST if exporter.forms else self._aim(scene)
        aims = [*(first - STEP * step for step in range(math.ceil((first - COARSEST) / STEP))), COARSEST]
        begin = bisect_left(aims, True, key=lambda aim: limit.share(rounding(aim).write(scene)[0].raw) <= 1)
        for aim in aims[min(begin, len(aims) - 1) :]:
            yield partial(self._fitted_to, exporter, rounding, scene, aim)

    def _fitted_to(self, exporter: Exporter, rounding: Rounding, scene: Scene, aim: float) -> Exported:
        return self._fit_rounded(exporter, rounding(aim), scene)[0]

    def _fit_rounded(
        self, exporter: Exporter, rounded: Rounded, scene: Scene, enough: float = math.inf
    ) -> tuple[Exported, float]:
        """One export, of the numbers with which it is nearest to the picture, and how near that is in dB; they are
        not fitted where rounding them is `enough`.
        """
        made, found = rounded.write(scene)
        near = self._near(found)
        if near < enough:
            with self._phase("fit numbers"):
                settled = _settled(scene, rounded.steps_of, self._views)
            again, found = rounded.write(settled)
            made, near = max((made, near), (again, self._near(found)), key=lambda tried: tried[1])
        lost = _lost(self._near(scene) - near) if self.picture else f"{near:.1f} dB from the render"
        return replace(made, notes=(*made.notes, f"{exporter.suffix[1:]}: numbers rounded, {lost}")), near

    def _aim(self, scene: Scene) -> float:
        """How near numbers that are only rounded are to be to the render, in dB, before they are fitted."""
        gained = GAINED if self.picture else GAINED_ALONE
        aim = -10 * math.log10(max(self._allowed(scene), 1e-12)) - gained
        return min(max(aim, COARSEST), FINEST)

    def _allowed(self, scene: Scene) -> float:
        """The mean squared error that rounding may add."""
        if self.picture is None:
            return float(10 ** (-USUAL_NEAR / 10))
        return float(10 ** (-self._near(scene) / 10) * (10 ** (WASTED / 10) - 1))

    # --- what is fitted to ----------------------------------------------------------------------------------------

    @cached_property
    def _shown(self) -> Picture:
        return self.picture or _picture_of(self.scene)

    @cached_property
    def _views(self) -> Views:
        return _views_of(self._shown)

    def _psnr(self, scene: Scene) -> float:
        """How near a scene is to the picture, in dB."""
        return min(_psnr_of(scene, self._shown), SAME)


def _is_plain(scene: Scene) -> bool:
    """Whether an SVG of plain elements, with names, is small enough: not where lines of one pen take fewer words."""
    is_single = all(len(layer.shapes) == 1 for layer in scene.layers)
    strokes = sum(shape.kind == STROKE for layer in scene.layers for shape in layer.shapes)
    return is_few_and_sharp(scene) and is_single and strokes < SEVERAL


def _mixes_colors(scene: Scene) -> bool:
    """Whether there are unions of several colours, which a drawing may not have the fill for."""
    return any(len({shape.color for shape in layer.seen}) > 1 for layer in scene.layers)


def _doublings(small: bytes, large: bytes) -> float:
    """How many times the bytes double from one text to another: the mean of what is kept and what is sent."""
    plain, sent = len(large) / len(small), gzipped_size(large) / gzipped_size(small)
    return 0.5 * math.log2(plain * sent)


def _lost(decibels: float) -> str:
    return f"{decibels:.2f} dB of the picture lost" if decibels >= 0.005 else "nothing of the picture lost"


@dataclass(frozen=True)
class Share:
    """How much of a size limit the largest of some exports of a scene takes, each in a small form; a little more, as
    its numbers are still to be fitted.
    """

    targets: tuple[str, ...]
    options: Options
    limit: ByteLimit
    picture: Picture | None = None

    def beside(self, picture: Picture) -> Share:
        """The same where it is known what is fitted to."""
        return replace(self, picture=picture)

    def __call__(self, scene: Scene) -> float:
        exports = Exports(scene, self.picture)
        sizes = [self.limit.share(exports.densest(target, self.options).raw) for target in self.targets]
        return max(sizes) / SURE

    def near(self, scene: Scene, picture: Picture) -> float:
        """How near these forms come to a picture, about, in dB: before their numbers are such as are written."""
        if any(EXPORTERS[target].draws(scene, self.options) for target in self.targets):
            return _psnr_of_drawable(_blurred(scene, _views_of(picture), DENSE), picture)
        return _psnr_of(scene, picture)


def share_of_limit(targets: Sequence[str], options: Options) -> Share:
    """That of these targets. Raises Sdf2vecError for an unknown one, or for what is no limit."""
    limit = ByteLimit.of(options.max_bytes or "")
    for target in targets:
        check_choice("target", target, EXPORTERS)
    return Share(tuple(targets), options, limit)

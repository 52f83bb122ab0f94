"""The exports of a scene, which is converted first for an exporter that doesn't accept it as it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

from .declared import check_choice
from .deferred import deferred
from .export import EXPORTERS, Exporter
from .export.byte_limit import ByteLimit
from .export.exported import Exported
from .export.options import Options
from .scene import Scene

_over_of: Callable[[Scene], tuple[Scene, float]] = deferred("sdf2vec.fit.conversion", "over_of")


class Exports:
    """The exports of one scene; where several need the scene under `over`, it is fitted again once."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def export(self, target: str, options: Options | None = None) -> Exported:
        """One export. Raises Sdf2vecError for an unknown target and for what the exporter can't do."""
        check_choice("target", target, EXPORTERS)
        exporter, options = EXPORTERS[target], options or Options()
        exporter.check_count(self.scene.shape_count, options)
        refusal = exporter.accepts(options).refusal(self.scene)
        if not refusal:
            return _made(exporter, self.scene, options)
        scene, decibels = self._over
        near = f" ({decibels:.1f} dB from its render)" if scene.layers else ""
        note = f"{target}: nothing can be added up {refusal}: fitted again under over{near}"
        made = _made(exporter, scene, options)
        return replace(made, notes=(note, *made.notes))

    def smallest(self, target: str, options: Options) -> Exported:
        """The smallest form of one export."""
        exporter = EXPORTERS[target]
        scene = self._over[0] if exporter.accepts(options).refusal(self.scene) else self.scene
        return exporter.from_finest(scene, options)[-1]()

    @cached_property
    def _over(self) -> tuple[Scene, float]:
        return _over_of(self.scene)


def _made(exporter: Exporter, scene: Scene, options: Options) -> Exported:
    """The finest that keeps to the size limit; where none does, the smallest."""
    if options.max_bytes is None:
        return exporter.write(scene, options)
    limit, tried = ByteLimit.of(options.max_bytes), []
    for make in exporter.from_finest(scene, options):
        tried.append(make())
        if limit.share(tried[-1].raw) <= 1:
            return tried[-1]
    made = min(tried, key=lambda form: limit.size(form.raw))
    name, size = exporter.suffix[1:], limit.size(made.raw)
    much = (
        f"{name}: {size:,} bytes at least, more than the limit of {limit}; fit fewer shapes, or --shapes auto"
    )
    return replace(made, notes=(*made.notes, much), met=False)


def share_of_limit(targets: Sequence[str], options: Options) -> Callable[[Scene], float]:
    """How much of the size limit the largest of some exports of a scene takes, each in its smallest form."""
    limit = ByteLimit.of(options.max_bytes or "")
    for target in targets:
        check_choice("target", target, EXPORTERS)

    def share(scene: Scene) -> float:
        exports = Exports(scene)
        return max(limit.share(exports.smallest(target, options).raw) for target in targets)

    return share

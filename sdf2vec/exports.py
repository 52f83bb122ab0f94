"""The exports of a scene, which is converted first for an exporter that doesn't accept it as it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

from .declared import check_choice
from .deferred import deferred
from .export import EXPORTERS
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
            return exporter.write(self.scene, options)
        scene, decibels = self._over
        near = f" ({decibels:.1f} dB from its render)" if scene.layers else ""
        note = f"{target}: nothing can be added up {refusal}: fitted again under over{near}"
        made = exporter.write(scene, options)
        return replace(made, notes=(note, *made.notes))

    @cached_property
    def _over(self) -> tuple[Scene, float]:
        return _over_of(self.scene)

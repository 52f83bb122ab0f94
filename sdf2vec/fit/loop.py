"""The fit: render, loss, backward, step. What happens when is data (`presets`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import itemgetter

import torch

from ..deferred import deferred
from ..errors import Sdf2vecError
from ..image import Picture
from ..render import fused
from ..render.tensors import Group, SceneTensors, from_scene, on_device, to_scene
from ..scene import Scene
from ..threads import threads_of_its_own
from .adam import Adam, adam_over
from .backends import Backend, choose
from .best import Best, faded, mean_color, nearest_of_its_own
from .constraints import enforce_min_thickness, least_length, project, too_small
from .growth import add, anywhere, densify, exchange, idle, importance, prune, relocate
from .initialization import Layers, background_of, empty_groups, place, tell_apart
from .joining import RESOLUTIONS as JOIN_RESOLUTIONS
from .joining import Search, join
from .losses import Objective, objective
from .pilots import PHASE as PILOT
from .pilots import pilot_preset, pilot_settings, shares_of
from .presets import MSE, Phase, Preset
from .settings import Settings, preset_of
from .steady import Steady, small_loss
from .steps import Composite, Steps
from .surroundings import View
from .views import scaled, view_of

THICKEN_EVERY = 10  # steps
AREA_WEIGHT = 1.0  # of the area constraint in the loss
JOIN_STEPS = 350  # about, of one try to join a shape to a layer
TRIAL_LAYERS, TRIAL_STEPS, TRIAL_RATE = 4, 60, 0.5
REFIT_STEPS = 100  # after the colours have been restricted
# scipy: most fits don't need it
restrict_colors: Callable[..., None] = deferred("sdf2vec.fit.palette", "restrict")
LEAST_ERROR = 1e-8  # mean squared, of a pilot: 80 dB
SAME_SHAPE = 0.01  # scene units by which a start scene's canvas may differ


@dataclass(frozen=True)
class Progress:
    """Where a fit stands, and on which device; `step` counts over all phases.

    `scene()` is the scene as it is now; while a later start is under way, the nearest of those that have ended.
    """

    phase: str
    step: int
    steps: int
    loss: float
    scene: Callable[[], Scene]
    device: str = "cpu"


Callback = Callable[[Progress], bool]  # returns True to stop


class Stopped(Exception):  # noqa: N818 (no error)
    """The callback has asked for the end of the fit."""


def fit_picture(
    picture: Picture,
    settings: Settings,
    callback: Callback = lambda progress: False,
    preset: Preset | None = None,
) -> Scene:
    """Fits shapes to a picture. The same settings give the same scene. `preset`: in place of theirs.

    The callback runs after every step; when it returns True, the fit ends and what is there is returned. Raises
    Sdf2vecError where the start scene does not suit the picture or the settings.
    """
    with threads_of_its_own():
        fit = Fit(picture, settings, callback, preset)
        fit.run()
    return fit.scene()


@dataclass(frozen=True, eq=False)
class Stage:
    """A phase with what it needs at its resolution: the target, how much each pixel matters, the loss."""

    phase: Phase
    target: torch.Tensor  # [C, H, W] premultiplied
    weights: torch.Tensor | None  # [H, W]
    measure: Objective

    @property
    def view(self) -> View:
        """What it draws, on the CPU."""
        return View(self.target.cpu(), None if self.weights is None else self.weights.cpu())


class Fit:
    """What a fit works with: settings, the picture's pixels, the scene as it is now, the optimiser."""

    def __init__(
        self, picture: Picture, settings: Settings, callback: Callback, preset: Preset | None = None
    ) -> None:
        self.settings, self.callback, self.picture = settings, callback, picture
        self.preset = preset or preset_of(settings)
        self.backend: Backend = choose(settings.device)
        self.generator = torch.Generator().manual_seed(settings.seed)
        self.pixels = picture.premultiplied
        self.sides = (picture.width, picture.height)
        self.pixel = 1.0 / min(self.sides)
        self.size = (picture.width * self.pixel, picture.height * self.pixel)
        self.wanted = settings.most // settings.union  # layers
        self.starts = 1 if settings.start is not None else self.preset.starts(self.wanted)
        self.done, self.steps, self.stopped = 0, self._count_steps(), False
        # of the starts that have ended, while a later one is under way
        self.nearest: SceneTensors | None = None
        self.layers = Layers(
            settings.kinds, settings.compositing, settings.union, settings.paint, self._shares()
        )
        self._begin()
        self._announce_compiling()

    def _begin(self) -> None:
        start = self._start()
        self.tensors = on_device(start, self.backend.device)
        self.least = least_length(start, self.pixel)
        self.optimizer, self.steady = self._adam(), Steady()
        self.taken: Steps | None = None  # how steps are, as long as the layers are the same

    @property
    def phases(self) -> tuple[Phase, ...]:
        """The phases of this fit; one that goes on from a scene leaves the first out."""
        phases = self.preset.phases
        return phases if self.settings.start is None or len(phases) == 1 else phases[1:]

    def scene(self) -> Scene:
        """The scene as it is now; while a later start is under way, the nearest of those that have ended."""
        return to_scene(self.nearest or self.tensors, *self.sides)

    def run(self) -> None:
        """The whole fit, in place. Also when it is stopped, no shape stays too thin and colours are restricted."""
        with suppress(Stopped):
            self._train_all()
        if self.settings.palette or self.settings.colors:
            stage = self.finest
            self._restrict_colors(stage)
            if not self.stopped:
                with suppress(Stopped):
                    self._refit(stage)
        enforce_min_thickness(self.tensors, self.pixel)
        if not self.stopped:
            self._fade()
        self.steady.say()

    def _train_all(self) -> None:
        """All phases and trials."""
        for phase in self.phases:
            stage = self.finest if phase is self.phases[-1] else self._stage(phase)
            if phase is self.phases[0] and self.starts > 1:
                self._train_starts(stage)
                continue
            for batch in range(phase.batches):
                if phase.batches == 1:
                    self._train(stage)
                else:
                    self.optimizer = self._adam()
                    self._train(stage, partial(_in_batch, batch, phase.batches))
        for _ in range(self.settings.trials):
            self._try(stage)
        if self.settings.cuts:
            self._join(stage)

    def _train_starts(self, stage: Stage) -> None:
        """A phase from several starts, of which the nearest goes on."""
        ended: list[tuple[float, SceneTensors, Adam, Steady]] = []
        for number in range(self.starts):
            if number:
                self.nearest = self.tensors
                self._begin()
            try:
                self._train(stage)
            finally:  # also when stopped
                self.nearest = None
                ended.append((self._loss(stage), self.tensors, self.optimizer, self.steady))
                _, self.tensors, self.optimizer, self.steady = min(ended, key=itemgetter(0))

    @cached_property
    def finest(self) -> Stage:
        """The last phase."""
        return self._stage(self.phases[-1])

    def _adam(self, frozen: tuple[str, ...] = ()) -> Adam:
        return adam_over(self.tensors, frozen)

    @property
    def _pilots(self) -> tuple[str, ...]:
        """The kinds that are tried, each alone, before the fit."""
        kinds = self.settings.kinds
        return kinds if len(kinds) > 1 and self.settings.start is None and self.wanted > len(kinds) else ()

    def _shares(self) -> tuple[float, ...]:
        """How much of the layers each kind gets; nothing where that is not tried."""
        return shares_of([self._try_kind(kind) for kind in self._pilots]) if self._pilots else ()

    def _try_kind(self, kind: str) -> float:
        """How near a short fit with this kind alone comes to the picture, in dB."""
        before = self.done

        def tick(progress: Progress) -> bool:
            self.done = before + progress.step
            return self.callback(replace(progress, step=self.done, steps=self.steps))

        settings = pilot_settings(self.settings, kind, self.wanted)
        pilot = Fit(self.picture, settings, tick, pilot_preset(self.preset))
        with suppress(Stopped):
            pilot._train_all()
        stage = pilot.finest
        with torch.no_grad():
            wrong = objective(MSE, stage.target, stage.weights)(pilot._draw(pilot.tensors, stage.target))
        return -10.0 * math.log10(max(float(wrong), LEAST_ERROR))

    def _count_steps(self) -> int:
        steps = sum(phase.total for phase in self.phases) + len(self._pilots) * PILOT.steps
        steps += (self.starts - 1) * self.phases[0].total
        steps += self.settings.trials * TRIAL_STEPS + self.settings.cuts * JOIN_STEPS
        return steps + (REFIT_STEPS if self.settings.palette or self.settings.colors else 0)

    def _start(self) -> SceneTensors:
        target = scaled(self.pixels, self._resolution(self.phases[0]))
        settings, layers = self.settings, self.layers
        if settings.start is None:
            growth = self.phases[0].growth
            count = growth.count(0, self.phases[0].steps, self.wanted) if growth else self.wanted
            return place(target, self.size, layers, count, self.preset.start, self.generator)
        _check_start(settings.start, self.size)
        tensors = replace(from_scene(settings.start), size=self.size)
        if tensors.opaque == (len(target) == 4):
            tensors.background = background_of(target)
        present = {group.structure for group in tensors.groups}
        tensors.groups += [group for group in empty_groups(layers) if group.structure not in present]
        self._resize(tensors, target)
        tell_apart(tensors, self.generator)
        return tensors

    def _resize(self, tensors: SceneTensors, target: torch.Tensor) -> None:
        """Brings a start scene to the number of shapes asked for, or just below it where unions leave a rest."""
        optimizer = adam_over(tensors)
        spare = tensors.shape_count - self.settings.most
        if spare > 0:
            image = fused.composite(tensors, target.shape[2], target.shape[1], len(target))
            scores = importance(image, tensors, self.generator)
            sizes = torch.cat([torch.full((len(group),), len(group.structure)) for group in tensors.groups])
            taken = sizes[torch.cat(scores).argsort(stable=True)].cumsum(0)
            exchange(tensors, optimizer, prune(scores, int((taken < spare).sum()) + 1), ())
        count = (self.settings.most - tensors.shape_count) // self.settings.union
        if count > 0:
            image = fused.composite(tensors, target.shape[2], target.shape[1], len(target))
            add(tensors, optimizer, image, target, count, self.layers, self.generator)

    def _announce_compiling(self) -> None:
        if not self.backend.is_compiled(self.tensors, self.pixels.shape[2]):
            self.callback(Progress("compiling kernels (once)", 0, self.steps, math.nan, self.scene))

    def _stage(self, phase: Phase) -> Stage:
        view, device = view_of(self.pixels, self.settings, self._resolution(phase)), self.backend.device
        target = view.target.to(device)
        weights = None if view.weights is None else view.weights.to(device)
        return Stage(phase, target, weights, objective(phase.loss, target, weights, self.backend.losses))

    def _resolution(self, phase: Phase) -> float:
        return self.preset.resolution(phase, self.settings.most)

    def _draw(
        self, tensors: SceneTensors, target: torch.Tensor, composite: Composite | None = None
    ) -> torch.Tensor:
        channels, height, width = target.shape
        return (composite or self.backend.composite)(tensors, width, height, channels)

    def _train(self, stage: Stage, moves: Callable[[Group], torch.Tensor] | None = None) -> None:
        """The steps of a phase; `moves` tells which layers of a group are trained, all without it.

        Where the shapes stay the same, it ends with the best state seen.
        """
        phase = stage.phase
        best = None
        if phase.growth is None and phase.relocation is None:
            project(self.tensors, self.least, self.preset.falloff)  # a start may be out of range
            best = Best(self.tensors)
        ground = mean_color(stage.target, stage.weights)
        self.steady.begin(small_loss(stage.measure, stage.target, ground))
        try:
            self._take_steps(stage, moves, best)
        finally:  # also when stopped
            self._settle(stage)
            if best:
                best.restore(self._loss(stage))

    def _take_steps(
        self, stage: Stage, moves: Callable[[Group], torch.Tensor] | None, best: Best | None
    ) -> None:
        phase, self.taken = stage.phase, None
        for step, rate in enumerate(phase.rates()):
            if phase.growth is not None and self.settings.start is None:
                self._grow(stage, phase.growth.count(step, phase.steps, self.wanted))
            if phase.relocation is not None and phase.relocation.is_due(step, phase.steps):
                self._relocate(stage, phase.relocation.share)
            loss = self._step(stage, rate, moves, best)
            self.done += 1
            self._report(phase, loss)

    def _step(
        self, stage: Stage, rate: float, moves: Callable[[Group], torch.Tensor] | None, best: Best | None
    ) -> float:
        taken = self.taken = self.taken or self._steps(stage)
        loss = taken.slope()
        if not self.steady.holds(loss, self.tensors, self.optimizer):
            return self.steady.loss
        if best:
            best.see(loss)
        self.steady.dropped += taken.drop_what_is_not_finite()
        if moves is not None:
            _freeze(self.tensors, moves)
        if not stage.phase.slows:
            self.steady.lengthen(taken.agreement(), rate)
        taken.move(rate * self.steady.factor)
        if self.done % THICKEN_EVERY == 0:
            enforce_min_thickness(self.tensors, self.pixel)
        return loss

    def _steps(self, stage: Stage) -> Steps:
        keep = partial(project, self.tensors, self.least, self.preset.falloff)
        return self.backend.steps(partial(self._value, stage), self.backend.composite, self.optimizer, keep)

    def _value(self, stage: Stage, composite: Composite) -> torch.Tensor:
        """What is descended."""
        value = stage.measure(self._draw(self.tensors, stage.target, composite))
        if self.preset.least_area > 0:
            least_area = self.preset.least_area * self.size[0] * self.size[1]
            value = value + AREA_WEIGHT * too_small(self.tensors, least_area)
        return value

    @torch.no_grad()
    def _loss(self, stage: Stage) -> float:
        return float(self._value(stage, self.backend.composite))

    def _settle(self, stage: Stage) -> None:
        """Before the layers change, or at an end: back to what was good, unless it still is."""
        self.steady.holds(self._loss(stage), self.tensors, self.optimizer)
        self.steady.forget()

    @torch.no_grad()
    def _fade(self) -> None:
        """What is no worse than a ground alone: by the loss that was asked for, or by PSNR and the preset's."""
        stage = self.finest
        squared = objective(MSE, stage.target, stage.weights)
        measures = (stage.measure,) if self.settings.loss else (squared, stage.measure)

        def wrong(scene: SceneTensors) -> tuple[float, ...]:
            image = self._draw(scene, stage.target)
            return tuple(float(measure(image)) for measure in measures)

        ground = mean_color(stage.target, stage.weights)
        if self.settings.palette or self.settings.colors:
            ground = nearest_of_its_own(self.tensors, ground)
        self.tensors = faded(self.tensors, ground, wrong)

    def _try(self, stage: Stage) -> None:
        """Starts a few layers anew, anywhere, trains them alone, and takes that back unless the loss falls."""
        count = min(TRIAL_LAYERS, self._replaceable)
        if count == 0:
            return
        before = [group.each(lambda tensor: tensor.detach().clone()) for group in self.tensors.groups]
        image = self._draw(self.tensors, stage.target)
        loss = float(stage.measure(image).detach())
        scores = self._scores(image, stage)
        del image  # with what its derivatives follow from, beside which no steps can be recorded
        fresh = anywhere(stage.target, count, self.tensors, self.layers, self.generator)
        relocate(self.tensors, self.optimizer, scores, fresh)
        first = self.tensors.layer_count - count
        phase = Phase("trial", TRIAL_STEPS, stage.phase.resolution, rate=TRIAL_RATE, end_rate=0.05)
        self.optimizer = self._adam()
        try:
            self._train(replace(stage, phase=phase), lambda group: group.order >= first)
        finally:  # also when stopped
            with torch.no_grad():
                worse = float(stage.measure(self._draw(self.tensors, stage.target))) >= loss
            if worse:
                self.tensors.groups = before
            self.optimizer = self._adam()

    def _join(self, fine: Stage) -> None:
        """Joins shapes to layers by trial, on the CPU."""
        phases = [Phase("joining", JOIN_STEPS * self.settings.cuts, size) for size in JOIN_RESOLUTIONS]
        views = [*(self._stage(phase).view for phase in phases), fine.view]
        last = self.done + phases[0].steps

        def tick(loss: float) -> None:
            self.done = min(self.done + 1, last)
            self._report(phases[0], loss)

        search = Search(self.layers, self.preset.falloff, self.generator, tick, self.pixel)
        try:
            for scene in join(on_device(self.tensors, "cpu"), views, search, self.settings.cuts):
                self.tensors = on_device(scene, self.backend.device)
        finally:  # also when stopped
            self.optimizer = self._adam()
        self.done = last

    def _report(self, phase: Phase, loss: float) -> None:
        if self.callback(Progress(phase.name, self.done, self.steps, loss, self.scene, self.backend.device)):
            self.stopped = True
            raise Stopped

    def _restrict_colors(self, stage: Stage) -> None:
        """To the palette given or, of so many colours, the best."""
        cover = importance(self._draw(self.tensors, stage.target), self.tensors, self.generator)
        restrict_colors(self.tensors, cover, self.settings.palette, self.settings.colors or 0, self.generator)

    def _refit(self, stage: Stage) -> None:
        """Trains all but the colours."""
        self.optimizer = self._adam(frozen=("color", "background"))
        phase = Phase("palette", REFIT_STEPS, stage.phase.resolution, rate=0.4, end_rate=0.02)
        self._train(replace(stage, phase=phase))

    def _relocate(self, stage: Stage, share: float) -> None:
        if self._replaceable == 0:
            return
        self._settle(stage)
        image = self._draw(self.tensors, stage.target)
        scores = self._scores(image, stage)
        resting = idle(scores, image, stage.target, stage.weights)
        count = min(max(round(share * self.tensors.layer_count), resting), self._replaceable)
        if count == 0:
            return
        layers = self.layers
        fresh = densify(image, stage.target, count, self.tensors, layers, self.generator, stage.weights)
        relocate(self.tensors, self.optimizer, scores, fresh)
        self.taken = None

    def _grow(self, stage: Stage, count: int) -> None:
        """New layers up to this number, and all rates for that."""
        count -= self.tensors.layer_count
        if count > 0:
            self._settle(stage)
            image = self._draw(self.tensors, stage.target)
            add(
                self.tensors,
                self.optimizer,
                image,
                stage.target,
                count,
                self.layers,
                self.generator,
                stage.weights,
            )
            self.optimizer, self.taken = self._adam().remembers(self.optimizer), None

    @property
    def _replaceable(self) -> int:
        """How many layers are of as many shapes as new ones, so that the number of shapes stays."""
        return sum(len(g) for g in self.tensors.groups if len(g.structure) == self.settings.union)

    def _scores(self, image: torch.Tensor, stage: Stage) -> list[torch.Tensor]:
        """The importance of each group's layers; infinite where they can't be replaced."""
        scores = importance(image, self.tensors, self.generator, stage.weights)
        return [
            score if len(group.structure) == self.settings.union else torch.full_like(score, math.inf)
            for score, group in zip(scores, self.tensors.groups, strict=True)
        ]


def _check_start(scene: Scene, size: tuple[float, float]) -> None:
    if max(abs(a - b) for a, b in zip(scene.extent, size, strict=True)) > SAME_SHAPE:
        wide, high = (f"{side:.3g}" for side in scene.extent)
        raise Sdf2vecError(
            f"the start scene has another shape than the picture: {wide} to {high}, not {size[0]:.3g} to {size[1]:.3g}"
        )


def _in_batch(batch: int, batches: int, group: Group) -> torch.Tensor:
    """Which layers of a group are in a batch: every so many-th of the draw order."""
    return group.order % batches == batch


def _freeze(tensors: SceneTensors, moves: Callable[[Group], torch.Tensor]) -> None:
    """Leaves the layers that may not move, and the background, without a derivative."""
    for group in tensors.groups:
        still = ~moves(group)
        for tensor in group.values.values():
            if tensor.grad is not None:
                tensor.grad[still] = 0.0
    if tensors.background.grad is not None:
        tensors.background.grad.zero_()

"""Which layers leave and which come, and where: against the dense renderer and against places known beforehand."""

import math

import pytest
import torch

from sdf2vec import Layer, Scene, Shape
from sdf2vec.fit import growth
from sdf2vec.fit.adam import Adam, adam_over
from sdf2vec.fit.growth import densify, exchange, importance, prune
from sdf2vec.fit.initialization import Layers, Places, empty_groups, groups_at
from sdf2vec.fit.loop import Fit
from sdf2vec.fit.matching_pursuit import WIDTH, Missing, Painted, Size, find_discs
from sdf2vec.fit.presets import PRESETS, Growth, Phase, Preset, Relocation
from sdf2vec.fit.settings import settings_of
from sdf2vec.image import Picture, load, resize
from sdf2vec.layer import Part
from sdf2vec.render.reference import composite
from sdf2vec.render.tensors import Group, from_scene, to_scene
from tests.fit.fitting import error, fitted, picture
from tests.scenes import random_scene


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def without(scene: Scene, index: int) -> Scene:
    return Scene(
        scene.width,
        scene.height,
        scene.layers[:index] + scene.layers[index + 1 :],
        scene.background,
        scene.compositing,
    )


def drawn(scene: Scene, channels: int) -> torch.Tensor:
    return composite(from_scene(scene, torch.float64), scene.width, scene.height)[:channels]


# --- importance --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("compositing", "transparent", "weighted"),
    [("over", False, True), ("additive", True, False)],
)
def test_importance_is_what_the_image_loses(monkeypatch, compositing, transparent, weighted):
    """Against leaving each layer out; the probes' spread is that of a mean of squares, at most √(2/probes)."""
    monkeypatch.setattr(growth, "PROBES", 500)
    kinds, look = ("circle", "gabor"), {"compositing": compositing, "transparent": transparent}
    scene = random_scene(kinds, width=18, height=12, layers=5, seed=3, joins=("union",), **look)
    channels = 4 if transparent else 3
    full = drawn(scene, channels)
    weights = torch.linspace(0.0, 1.0, 18).expand(12, 18) if weighted else None
    changes = [
        (full - drawn(without(scene, i), channels)) * (1 if weights is None else weights) for i in range(5)
    ]
    expected = torch.tensor([float(change.square().sum()) for change in changes])
    tensors = from_scene(scene)
    adam_over(tensors)
    image = composite(tensors, 18, 12)[:channels]
    scores = importance(image, tensors, seeded(), weights)
    estimate = torch.empty(5)
    for group, score in zip(tensors.groups, scores, strict=True):
        estimate[group.order] = score / 500
    assert (estimate - expected).abs().max() <= 5 * math.sqrt(2 / 500) * expected.max()
    assert ((estimate / expected - 1).abs()[expected > 1e-6] < 5 * math.sqrt(2 / 500)).all()


def test_importance_of_a_layer_that_shows_nowhere_is_nothing():
    hidden = Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.1)
    cover = Shape.of("circle", (0, 1, 0), center=(0, 0), radius=0.45)
    tensors = from_scene(Scene(16, 16, (Layer((hidden,), 0.0), Layer((cover,), 0.0)), (0, 0, 0)))
    tensors.groups += empty_groups(Layers(("box",), "over"))
    adam_over(tensors)
    scores = importance(composite(tensors, 16, 16), tensors, seeded())
    assert float(scores[0][0]) < 1e-6 < float(scores[0][1])
    assert scores[1].shape == (0,)


def test_what_matters_least_is_pruned():
    stays = prune([torch.tensor([3.0, 0.5, 9.0]), torch.tensor([]), torch.tensor([1.0, 0.1])], 3)
    assert [rows.tolist() for rows in stays] == [[0, 2], [], []]
    assert [rows.tolist() for rows in prune([torch.tensor([1.0, 1.0, 1.0])], 2)] == [
        [2]
    ]  # ties: the first ones
    assert [rows.tolist() for rows in prune([torch.tensor([1.0, 2.0])], 0)] == [[0, 1]]


# --- exchange ----------------------------------------------------------------------------------------------

CIRCLES = Layers(("circle",), "over")


def circles(count: int, seed: int = 0) -> list[Group]:
    r = seeded(seed)
    places = Places(
        torch.rand(count, 2, generator=r) - 0.5, torch.full((count,), 0.2), torch.rand(count, 4, generator=r)
    )
    return groups_at(places, CIRCLES, r)


def two_kinds():
    scene = random_scene(("circle", "box"), layers=8, joins=(), paints=("flat", "linear"))
    tensors = from_scene(scene)
    return tensors, adam_over(tensors)


def step(tensors, optimizer, times=1):
    """Steps down the squared image, with the dense renderer."""
    for _ in range(times):
        optimizer.zero_grad()
        composite(tensors, 9, 6).square().sum().backward()
        optimizer.step()


def numbers_of(tensors):
    return [tensor.detach().clone() for group in tensors.groups for tensor in group.values.values()]


def test_exchanging_nothing_changes_no_step():
    results = []
    for exchanged in (False, True):
        tensors, optimizer = two_kinds()
        step(tensors, optimizer, 3)
        if exchanged:
            everything = [torch.arange(len(group.order)) for group in tensors.groups]
            exchange(tensors, optimizer, everything, ())
        step(tensors, optimizer, 2)
        results.append(numbers_of(tensors))
    assert all(torch.equal(a, b) for a, b in zip(*results, strict=True))


def test_rows_that_stay_keep_their_history_and_new_ones_have_none():
    tensors, optimizer = two_kinds()
    step(tensors, optimizer, 3)
    radius = tensors.groups[0].of("radius", 0)
    index = next(i for i, moving in enumerate(optimizer.moving) if moving.tensor is radius)
    moving = optimizer.moving[index]
    before, values = (moving.mean.clone(), moving.square.clone()), radius.detach().clone()
    fresh = circles(2)
    for group in fresh:
        group.order += tensors.layer_count
    stays = [torch.tensor([0, 3]), torch.arange(4)]
    exchange(tensors, optimizer, stays, fresh)
    now = tensors.groups[0].of("radius", 0)
    assert torch.equal(now[:2], values[[0, 3]])
    assert torch.equal(now[2:], fresh[0].of("radius", 0))
    assert moving.tensor is now
    for after, old in zip((moving.mean, moving.square), before, strict=True):
        assert torch.equal(after[:2], old[[0, 3]])
        assert float(old.abs().min()) > 0
        assert not after[2:].any()
    assert float(moving.steps) == 3
    trained = {id(moving.tensor) for moving in optimizer.moving}
    assert trained == {id(t) for g in tensors.groups for t in g.values.values()} | {id(tensors.background)}
    step(tensors, optimizer)
    assert not torch.equal(now[:2], values[[0, 3]])


def test_the_draw_order_has_no_gaps_and_new_layers_lie_on_top():
    tensors, optimizer = two_kinds()  # orders: circles 0 2 4 6, boxes 1 3 5 7
    fresh = circles(2)
    for group in fresh:
        group.order += 8
    exchange(tensors, optimizer, [torch.tensor([1, 3]), torch.tensor([0, 1])], fresh)
    assert tensors.groups[0].order.tolist() == [1, 3, 4, 5]  # was 2, 6, new, new
    assert tensors.groups[1].order.tolist() == [0, 2]  # was 1, 3


def test_a_group_may_lose_all_rows_and_a_new_kind_may_come():
    scene = random_scene(("box",), layers=3, joins=(), paints=("flat",))
    tensors = from_scene(scene)
    optimizer = adam_over(tensors)
    exchange(tensors, optimizer, [torch.arange(0)], circles(2))
    assert [(group.structure, len(group)) for group in tensors.groups] == [
        ((Part("box"),), 0),
        ((Part("circle"),), 2),
    ]
    assert {layer.structure for layer in to_scene(tensors, 60, 40).layers} == {(Part("circle"),)}
    unions = Layers(("box",), "over", 2)
    places = Places(torch.zeros(1, 2), torch.full((1,), 0.2), torch.full((1, 4), 0.5))
    exchange(tensors, optimizer, [torch.arange(0), torch.arange(2)], groups_at(places, unions, seeded(), 2))
    union = (Part("box"), Part("box", join="union"))
    assert [(group.structure, len(group)) for group in tensors.groups][2:] == [(union, 1)]


def test_adam_is_torchs_own():
    start, pull = torch.tensor([1.0, -2.0]), torch.tensor([0.3, 4.0])
    ours, theirs = start.clone(), start.clone().requires_grad_()
    optimizer, other = Adam([(ours, 0.05)]), torch.optim.Adam([theirs], lr=0.05, betas=(0.9, 0.9), eps=1e-12)
    for _ in range(5):
        for tensor, one in ((ours, optimizer), (theirs, other)):
            one.zero_grad()
            (tensor * pull).square().sum().backward()
            one.step()
    assert torch.allclose(ours, theirs, atol=1e-6)
    assert not torch.allclose(ours, start, atol=0.1)


# --- densify: matching pursuit ---------------------------------------------------------------------------------


def blob(
    x: float, y: float, radius: float, amount: list[float], width: int = 48, height: int = 40
) -> torch.Tensor:
    """A Gaussian with its centre in pixels, [3, H, W], written out anew."""
    rows, columns = torch.meshgrid(torch.arange(height) + 0.5, torch.arange(width) + 0.5, indexing="ij")
    bump = torch.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * (WIDTH * radius) ** 2))
    return torch.tensor(amount)[:, None, None] * bump


def missing(residual: torch.Tensor) -> Missing:
    """A residual that matters as much everywhere."""
    return Missing(residual.clone(), torch.ones(residual.shape[1:]))


@pytest.mark.parametrize("radius", [0.8 * 1.4**3, 0.8 * 1.4**6])
def test_pursuit_finds_a_blob(radius):
    found = find_discs(missing(blob(21.5, 25.5, radius, [0.5, -0.25, 0.125])), 1)
    assert found.centers.tolist() == [[21.5, 25.5]]
    assert float(found.radii[0]) == pytest.approx(radius, rel=1e-5)
    assert found.colors[0].tolist() == pytest.approx([0.35, -0.175, 0.0875], rel=0.02)  # of a disc: 0.7


@pytest.mark.parametrize("radius", [0.8 * 1.4**3, 0.8 * 1.4**6, 0.8 * 1.4**8])
@pytest.mark.parametrize("x", [20.5, 21.5, 22.5, 23.5])
def test_pursuit_finds_a_blob_between_the_places_where_it_looks(radius, x):
    """They are at most a third of a radius apart."""
    found = find_discs(missing(blob(x, 19.5, radius, [0.5, -0.25, 0.125])), 1)
    assert (found.centers - torch.tensor([x, 19.5])).abs().max() <= radius / 6
    assert float(found.radii[0]) == pytest.approx(radius, rel=1e-5)


@pytest.mark.parametrize("radius", [3.0, 5.0, 9.0])
def test_pursuit_finds_a_disc(radius):
    disc = (blob(21.5, 19.5, 1, [1.0]) > math.exp(-(radius**2) / (2 * WIDTH**2))).float()
    found = find_discs(missing(disc * torch.tensor([0.4, -0.2, 0.1])[:, None, None]), 1)
    assert (found.centers - torch.tensor([21.5, 19.5])).abs().max() <= 1
    assert radius / 1.25 < float(found.radii[0]) < radius * 1.25
    assert found.colors[0].tolist() == pytest.approx([0.4, -0.2, 0.1], rel=0.15)


def test_pursuit_takes_the_largest_gains_first():
    """The gain is amount² times area: by hand 0.25²·r², so the wide faint one comes before the narrow strong one."""
    residual = blob(12.5, 12.5, 0.8 * 1.4**6, [0.25, 0, 0]) + blob(38.5, 30.5, 0.8 * 1.4**2, [0, 0.6, 0])
    found = find_discs(missing(residual), 2)
    assert (found.centers - torch.tensor([[12.5, 12.5], [38.5, 30.5]])).abs().max() <= 1
    assert found.colors[0, 0] == pytest.approx(0.7 * 0.25, rel=0.1)
    assert found.colors[1, 1] == pytest.approx(0.7 * 0.6, rel=0.1)


@pytest.mark.parametrize("size", [(1, 1), (4, 4), (2, 37)])
@pytest.mark.parametrize("canvas", [Missing, Painted])
def test_pursuit_never_gives_more_than_asked_or_than_is_missing(size, canvas):
    for count in (0, 1, 50):
        weights, white = torch.ones(size), torch.ones(3, *size)
        found = find_discs(
            missing(white) if canvas is Missing else Painted(0.0 * white, white, weights), count
        )
        assert len(found.centers) == len(found.radii) == len(found.colors) <= count
        assert (len(found.centers) > 0) == (count > 0)
        if count:
            assert float(found.colors.abs().max()) < 3.0
            assert float(found.centers.min()) >= 0.5
            assert (found.centers <= torch.tensor([size[1], size[0]]) - 0.5).all()


@pytest.mark.parametrize(
    "canvas", [missing, lambda zero: Painted(zero + 0.25, zero + 0.25, torch.ones(30, 20))]
)
def test_pursuit_finds_nothing_where_nothing_is_missing(canvas):
    assert len(find_discs(canvas(torch.zeros(3, 30, 20)), 5).centers) == 0


@pytest.mark.parametrize("weighted", [False, True])
def test_what_is_painted_gains_what_it_should_and_no_other_color_gains_more(weighted):
    """Beside errors measured before and after a Gaussian of every size is laid over the middle of noise."""
    noise = 0.4 + 0.2 * torch.rand((2, 3, 30, 24), generator=seeded())
    weights = torch.rand((30, 24), generator=seeded(1)) if weighted else torch.ones(30, 24)
    canvas = Painted(noise[0], noise[1], weights)
    radii, x, y = (1.0, 7.0), 11, 13
    sizes = [Size.of(radius, 30, 24) for radius in radii]
    responses = list(canvas.responses(sizes))

    def gain(color: torch.Tensor, index: int) -> float:
        cover = blob(x + 0.5, y + 0.5, radii[index], [1.0], 24, 30)
        painted = noise[0] + cover * (color[:, None, None] - noise[0])
        before, after = (((image - noise[1]) * weights).square().sum() for image in (noise[0], painted))
        return float(before - after)

    for index, (size, (colors, gains)) in enumerate(zip(sizes, responses, strict=True)):
        place = next(
            (row, column)
            for row in range(gains.shape[0])
            for column in range(gains.shape[1])
            if (size.down.place(row), size.across.place(column)) == (y, x)
        )
        best = colors[(slice(None), *place)]
        assert float(gains[place]) == pytest.approx(gain(best, index), abs=1e-3)
        for change in torch.eye(3) * 0.02:
            assert max(gain(best + change, index), gain(best - change, index)) < gain(best, index)


def test_a_wide_faint_error_is_not_painted_over_fine_detail():
    """Stripes that are all a little too dark: to add a wide disc helps, to paint one would hide them."""
    stripes = (torch.arange(48) % 2 * 0.6).expand(3, 40, 48)
    target = stripes + blob(24.5, 20.5, 8.0, [0.1, 0.1, 0.1])
    added = find_discs(missing(target - stripes), 1)
    painted = find_discs(Painted(stripes.clone(), target, torch.ones(40, 48)), 1)
    assert float(added.radii[0]) > 5.0
    assert len(painted.radii) == 0 or float(painted.radii[0]) < 1.5


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("union", [1, 2])
def test_new_layers_bring_the_image_nearer_at_once(compositing, union):
    background = torch.tensor([0.2, 0.3, 0.4])[:, None, None].expand(3, 40, 48)
    target = background + blob(12.5, 10.5, 6, [0.6, 0.2, -0.3]) + blob(34.5, 28.5, 8, [-0.1, 0.5, 0.5])
    tensors = from_scene(Scene(48, 40, (), (0.2, 0.3, 0.4), compositing))
    image = composite(tensors, 48, 40)[:3]
    before = float((image - target).square().mean())
    layers = Layers(("circle",), compositing, union)
    tensors.groups += densify(image, target, 2, tensors, layers, seeded())
    after = float((composite(tensors, 48, 40)[:3] - target).square().mean())
    assert after < 0.7 * before
    middles = together(tensors.groups[0], "center").mean(dim=1)
    expected = (torch.tensor([[34.5, 28.5], [12.5, 10.5]]) - torch.tensor([24, 20])) / 40
    assert (middles - expected).abs().max() < 0.06


def test_new_layers_come_where_the_weights_are():
    target = blob(12.5, 10.5, 6, [0.3, 0.3, 0.3]) + blob(34.5, 28.5, 8, [0.5, 0.5, 0.5])
    tensors = from_scene(Scene(48, 40, (), (0, 0, 0)))
    weights = torch.zeros(40, 48)
    weights[:, :24] = 1
    (group,) = densify(torch.zeros(3, 40, 48), target, 1, tensors, CIRCLES, seeded(), weights)
    assert group.of("center", 0)[0].tolist() == pytest.approx([-11.5 / 40, -9.5 / 40], abs=0.03)


def together(group: Group, name: str) -> torch.Tensor:
    """A parameter of all parts, [G, parts, width]."""
    return torch.stack([group.of(name, part) for part in range(len(group.structure))], dim=1)


# --- unions as they start ----------------------------------------------------------------------------------


@pytest.mark.parametrize("union", [1, 2, 5])
def test_the_shapes_of_a_union_lie_around_its_centre(union):
    centers = torch.tensor([[0.1, -0.2], [0.3, 0.0]])
    sizes, colors = torch.tensor([0.2, 0.1]), torch.tensor([[0.1, 0.2, 0.3, 1.0], [0.4, 0.5, 0.6, 0.5]])
    (group,) = groups_at(
        Places(centers, sizes, colors), Layers(("circle",), "over", union), seeded(), first=7
    )
    assert (len(group.structure), group.order.tolist()) == (union, [7, 8])
    parts = together(group, "center")
    assert torch.allclose(parts.mean(dim=1), centers, atol=1e-6)
    away = 0.0 if union == 1 else 0.6
    assert torch.allclose(
        (parts - centers[:, None]).norm(dim=2), away * sizes[:, None].expand(-1, union), atol=1e-6
    )
    # together they have the area of one disc of this size
    assert torch.allclose(together(group, "radius")[..., 0].square().sum(dim=1), sizes.square(), rtol=1e-5)
    assert torch.equal(together(group, "color"), colors[:, None, :3].expand(-1, union, -1))
    assert group.opacity[:, 0].tolist() == pytest.approx([0.8, 0.4])
    assert all(bool((group.of("smoothness", part) > 0).all()) for part in range(1, union))


def test_kinds_are_dealt_out():
    count = 300
    places = Places(torch.zeros(count, 2), torch.full((count,), 0.1), torch.ones(count, 4))
    groups = groups_at(places, Layers(("circle", "box", "triangle"), "over"), seeded(), first=5)
    assert [group.structure[0].kind for group in groups] == ["circle", "box", "triangle"]
    assert all(60 < len(group.order) < 140 for group in groups)
    assert sorted(torch.cat([group.order for group in groups]).tolist()) == list(range(5, 5 + count))
    assert [len(group.order) for group in empty_groups(Layers(("circle", "box"), "over"))] == [0, 0]


def test_relocation_is_due_in_the_middle_of_its_stretches():
    """By hand: every 10, from 5 on, while less than 80 % of 50 steps are done."""
    assert [s for s in range(50) if Relocation(10, 0.1).is_due(s, 50)] == [5, 15, 25, 35]
    assert [s for s in range(50) if Relocation(20, 0.1, until=1.0).is_due(s, 50)] == [10, 30]


# --- from few to all ---------------------------------------------------------------------------------------


def test_layers_double_until_all_are_there():
    """By hand: 4, 8, 16, then all 20; half of them first where they are few."""
    assert [Growth(4, 10).count(step, 100, 20) for step in (0, 9, 10, 19, 20, 29, 30, 99)] == [
        *(4, 4, 8, 8, 16, 16, 20, 20)
    ]
    assert [Growth(4, 10).count(step, 100, full) for full in (1, 4, 8) for step in (0, 10)] == [
        *(1, 1, 2, 4, 4, 8)
    ]


@pytest.mark.parametrize("steps", [1, 3, 20, 200])
@pytest.mark.parametrize("full", [5, 64, 100, 8192])
def test_all_layers_are_there_before_a_phase_ends(steps, full):
    counts = [Growth(4, 30).count(step, steps, full) for step in range(steps)]
    assert counts == sorted(counts)
    assert counts[-1] == full
    assert counts[0] == (
        full if steps == 1 or (full > 8 and steps == 3) else max(min(4, full // 2), full // 32)
    )


@pytest.mark.usefixtures("kernels_there")
@pytest.mark.parametrize(("shapes", "union"), [(1, 1), (9, 1), (30, 1), (60, 2)])
def test_a_fit_that_grows_ends_with_all_shapes(monkeypatch, shapes, union):
    growing = Phase("all", 40, 24, growth=Growth(4, 5), relocation=Relocation(6, 0.2, until=0.5))
    monkeypatch.setitem(PRESETS, "fast", Preset((growing,)))
    settings = settings_of(shapes, kind="circle", preset="fast", union=union)
    drawn: list[int] = []

    def look(progress: object) -> bool:
        drawn.append(fit.tensors.layer_count)
        return False

    fit = Fit(picture(), settings, look)
    assert fit.tensors.layer_count == min(4, shapes // union)
    fit.run()
    assert sorted(set(drawn)) == sorted({min(count, shapes // union) for count in (4, 8, 16, 30)})
    assert (drawn[0], drawn[-1]) == (min(4, shapes // union), shapes // union)


def test_what_is_known_of_old_layers_stays_and_rates_are_of_the_new_number():
    scene = Scene(24, 24, tuple(Layer((Shape("circle", (0, 0, 0.2), (1, 0, 0)),), 0.1) for _ in range(3)))
    few = adam_over(from_scene(scene))
    for moving in few.moving:
        moving.mean += 2.0
    tensors = from_scene(scene)
    for group in tensors.groups:
        group.values = {slot: few.moving[i].tensor for i, slot in enumerate(group.values)}
    many = adam_over(tensors).remembers(few)
    assert [float(moving.mean.mean()) for moving in many.moving[:-1]] == [2.0] * (len(many.moving) - 1)
    assert float(many.moving[-1].mean.mean()) == 0.0  # a background that is another tensor


def test_more_shapes_are_never_worse():
    """Six pixels a circle: relocation once hid what was there below wide circles, and 1024 came out 7 dB worse."""
    pixels = resize(load("examples/coffee.png").pixels, 68, 45)
    few, many = (
        error(fitted(Picture(pixels), count, preset="balanced"), Picture(pixels)) for count in (256, 512)
    )
    assert many < 0.5 * few

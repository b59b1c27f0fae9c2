"""The explorer of a report, moved by a real pointer and real keys: its numbers are those of `predict`, bit for bit."""

import base64
import csv
import re
from pathlib import Path

import numpy as np
import pytest
from opened_page import Browser, Page, opened

import hystfmu as hy
from hystfmu.face.page import explorer
from hystfmu.report.page import Section, page, section

KEYS = ("prandtl_ishlinskii", "play_bank_mlp", "zhao_tan_mlp")
Models = dict[str, hy.Model]


@pytest.fixture(scope="module")
def models() -> Models:
    data = hy.synthetic.piezo(40, 1000.0)
    short = {"starts": 1, "iterations": 5}
    options = {"prandtl_ishlinskii": {"N": 20}, "play_bank_mlp": {"N": 10, **short}, "zhao_tan_mlp": short}
    return {key: hy.fit(data, key, **options[key]) for key in KEYS}


@pytest.fixture(scope="module")
def file(models: Models, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = explorer(list(models.values()), hy.synthetic.piezo(40, 1000.0), "voltage (V)", "displacement (um)")
    path = tmp_path_factory.mktemp("explorer") / "page.html"
    path.write_text(page("explorer", ["<h1>explorer</h1>", section(Section("Explorer", explorer=made))]))
    return path


def path_of(p: Page) -> dict[str, np.ndarray]:
    """The columns of the file that the page saves: every double as its shortest digits, which give it back."""
    with p.expect_download() as waited:
        p.get_by_role("button", name="Save the path").click()
    rows = list(csv.reader(waited.value.path().read_text().splitlines()))
    columns = np.array(rows[1:], dtype=float).T
    return dict(zip(rows[0], columns, strict=True))


def drag(p: Page, shares: list[float]) -> None:
    """Drag within the loop plot through these shares of its width."""
    box = p.locator("canvas.loop").bounding_box()
    assert box is not None
    for k, share in enumerate(shares):
        p.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 2, steps=1 if k == 0 else 7)
        if k == 0:
            p.mouse.down()
    p.mouse.up()


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return [v.hex() for v in a.tolist()] == [v.hex() for v in b.tolist()]


@pytest.mark.turn("pages in a browser", name="explorer")
def test_a_drag_draws_the_values_of_predict_and_a_moved_parameter_gives_them_anew(
    browser: Browser, file: Path, models: Models
) -> None:
    with opened(browser, file) as p:
        drag(p, [0.2, 0.9, 0.35, 0.7, 0.5, 0.6])
        found = path_of(p)
        status = p.locator(".status").text_content()
        p.get_by_label("parameter").select_option(label="prandtl_ishlinskii: hysteresis_r (V)")
        p.get_by_label("amount").focus()
        p.keyboard.press("End")
        after = path_of(p)
        assert "Parameters were moved" in p.locator(".status").text_content()
        p.get_by_role("button", name="Values of the model").click()
        back = path_of(p)
    assert len(found["u"]) > 300
    assert np.ptp(found["u"]) > 60
    assert np.sum(np.diff(np.sign(np.diff(found["u"]))) != 0) >= 4
    for key, m in models.items():
        assert same_bits(found[key], m.predict(found["u"])), key
    assert f"prandtl_ishlinskii {found['prandtl_ishlinskii'][-1]:.4g}"[:-1] in status
    model = models["prandtl_ishlinskii"]
    node = model.graph.node("hysteresis")
    twice = hy.Node(node.name, node.type, node.dims, {**node.values, "r": 2 * node.value("r")})
    assert same_bits(after["u"], found["u"])
    assert same_bits(after[model.key], model.graph.replace(twice).run(found["u"], 1e-3))
    assert not same_bits(after[model.key], found[model.key])
    assert same_bits(back[model.key], found[model.key])


@pytest.mark.turn("pages in a browser", name="explorer")
def test_the_inverse_in_front(browser: Browser, file: Path, models: Models) -> None:
    model = models["prandtl_ishlinskii"]
    with opened(browser, file) as p:
        p.get_by_label("in front").select_option(label="inverse of prandtl_ishlinskii")
        drag(p, [0.3, 0.8, 0.4])
        found = path_of(p)
        assert "wanted output" in p.locator("canvas.loop").get_attribute("aria-label")
    assert same_bits(found["u"], model.inverse("exact").predict(found["wanted"]))
    assert same_bits(found["prandtl_ishlinskii"], model.predict(found["u"]))
    np.testing.assert_allclose(found["prandtl_ishlinskii"], found["wanted"], atol=1e-9)


@pytest.mark.stress
def test_keys_move_the_input_and_the_block_holds_its_turning_points(browser: Browser, file: Path) -> None:
    with opened(browser, file) as p:
        p.locator("canvas.loop").focus()
        for key in ["PageUp"] * 8 + ["PageDown"] * 6 + ["PageUp"] * 4 + ["ArrowRight", "ArrowLeft"]:
            p.keyboard.press(key)
        p.locator(".about", has_text="holds 4 turning points").wait_for()  # 0, 80, 20 and 61
        found, slider = path_of(p), p.locator("canvas.loop")
        assert float(slider.get_attribute("aria-valuenow")) == pytest.approx(60)
        assert float(slider.get_attribute("aria-valuemax")) == pytest.approx(100)
    u = found["u"]
    assert [round(float(v), 9) for v in u[1:-1][np.diff(np.sign(np.diff(u))) != 0]] == [80.0, 20.0, 61.0]


@pytest.mark.stress
def test_space_plays_the_signal_at_once_without_motion(browser: Browser, file: Path, models: Models) -> None:
    with opened(browser, file, reduced_motion="reduce") as p:
        p.locator("canvas.loop").focus()
        p.keyboard.press("Space")
        p.locator("canvas.time[aria-label*='to 4 s']").wait_for()
        assert p.get_by_role("button", name="Play").is_visible()
        found = path_of(p)
    t = np.arange(4000) / 400
    wave = 50 - 50 * np.cos(2 * np.pi * t) * (1 - t / 10)
    np.testing.assert_allclose(found["u"][-len(wave) + 1 :], wave[1:], atol=1e-9)
    assert same_bits(found["play_bank_mlp"], models["play_bank_mlp"].predict(found["u"]))


@pytest.mark.stress
def test_playing_moves_and_pauses(browser: Browser, file: Path) -> None:
    with opened(browser, file) as p:
        p.get_by_label("signal").select_option(label="random reversals")
        p.get_by_role("button", name="Play").click()
        for _ in range(1500):  # `wait_for_function` evaluates a text in the page, which its policy refuses
            if float(p.locator("canvas.loop").get_attribute("aria-valuenow") or 0) > 20:
                break
            p.wait_for_timeout(20)
        p.get_by_role("button", name="Pause").click()
        first = path_of(p)
        p.wait_for_timeout(100)
        assert len(path_of(p)["u"]) == len(first["u"])
        p.get_by_role("button", name="Restart").click()
        assert len(path_of(p)["u"]) == 1


@pytest.mark.stress
def test_a_damaged_model_is_told(browser: Browser, file: Path, models: Models, tmp_path: Path) -> None:
    good = base64.b64encode(models["prandtl_ishlinskii"].graph.to_bytes()).decode()
    bad = tmp_path / "bad.html"
    bad.write_text(file.read_text().replace(good, good[:200] + "AAAA" + good[204:]))
    assert bad.read_text() != file.read_text()
    with opened(browser, bad, waits=False) as p:
        p.get_by_role("alert", name="").wait_for()
        assert "a model cannot be opened" in p.get_by_role("alert").text_content()


@pytest.mark.stress
def test_hover_names_the_nearest_point(browser: Browser, file: Path) -> None:
    with opened(browser, file) as p:
        drag(p, [0.2, 0.8])
        p.get_by_label("memory of").select_option(label="play_bank_mlp")
        p.locator(".about", has_text="plays of the block bank").wait_for()
        found, box = path_of(p), p.locator("canvas.loop").bounding_box()
        for share in np.linspace(0.1, 0.9, 30):
            p.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + share * box["height"])
            if text := re.search(r": voltage \(V\) ([\d.-]+), displacement", p.locator(".status").text_content()):
                break
        else:
            pytest.fail("no point found")
        assert np.abs(found["u"] - float(text[1])).min() < 1e-3


@pytest.mark.stress
def test_a_finger_moves_the_input(browser: Browser, file: Path, models: Models) -> None:
    with opened(browser, file, has_touch=True, viewport={"width": 400, "height": 800}) as p:
        box = p.locator("canvas.loop").bounding_box()
        for share in (0.8, 0.4):
            p.touchscreen.tap(box["x"] + share * box["width"], box["y"] + 100)
        found = path_of(p)
    assert np.ptp(found["u"]) > 50
    assert same_bits(found["zhao_tan_mlp"], models["zhao_tan_mlp"].predict(found["u"]))

"""Model files: a round trip keeps every bit; errors are one line that names the file and the key."""

import numpy as np
import pytest

from hystfmu import Graph, InputError, Model, Node


def model():
    rng = np.random.default_rng(0)
    node = Node(
        "pi", "prandtl_ishlinskii", {}, {"r": np.sort(rng.uniform(0, 1, 7)), "w": rng.normal(size=7), "w0": 1 / 3}
    )
    return Model("prandtl_ishlinskii", Graph.single(node), 1e-3, "text", {"rms": 0.1}, {"data": "x.csv"})


def test_round_trip_keeps_every_bit(tmp_path):
    first = model()
    first.save(tmp_path / "m.model.toml")
    second = Model.load(tmp_path / "m.model.toml")
    assert second.graph.to_bytes() == first.graph.to_bytes()
    assert (second.key, second.step, second.text, second.fit, second.provenance) == (
        first.key,
        first.step,
        first.text,
        first.fit,
        first.provenance,
    )
    assert not list(tmp_path.glob(".*")), "a temporary file was left"


def test_a_byte_order_mark_is_no_text(tmp_path):
    path = tmp_path / "m.model.toml"
    model().save(path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert Model.load(path).graph.to_bytes() == model().graph.to_bytes()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "format = 1",
            "format = 9",
            "format: The format must be 1. Got 9 of a newer version .*: pip install --upgrade hystfmu",
        ),
        ("format = 1", "format = 2\nkeys_to_come = 3", "format: The format must be 1. Got 2"),
        (
            "format = 1",
            "format = 0",
            "format: The format must be 1. Got 0 of an older version of HystFMU: make the file anew",
        ),
        ("format = 1\n", "", "format: The format must be 1. Got none, as in older versions of HystFMU: make the file"),
        ("format = 1", "format = 'x'", "format: The value must be 1. Got 'x' instead."),
        ('type = "prandtl_ishlinskii"', 'type = "preisach2"', "Got 'preisach2' instead"),
        ("w0 = 0.333", 'w0 = "a"\nw9 = 0.333', "A parameter of .* must be one of .*. Got 'w9' instead."),
        ("step = 0.001", "step = -1.0", "step: The value must be greater than 0. Got -1.0 instead."),
        ("step = 0.001", "step = 'x'", "step"),
        ("[provenance]", "[provenance", "must be valid TOML"),
        ("wires = []", 'wires = [["a", "b", "c"]]', "wires"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, old, new, message):
    path = tmp_path / "m.model.toml"
    model().save(path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message) as e:
        Model.load(path)
    assert str(path) in str(e.value)
    assert "\n" not in str(e.value)


def test_a_missing_file_is_one_line(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        Model.load(tmp_path / "none.model.toml")


def test_nothing_is_written_where_it_cannot_be(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        model().save(tmp_path / "file" / "m.model.toml")

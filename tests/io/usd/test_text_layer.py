"""USD text parsed in parts gives the layer that OpenUSD reads from the whole."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from warpjld.io.usd.long_samples import find_long_samples

Sdf = pytest.importorskip("pxr.Sdf", reason="needs OpenUSD")

from warpjld.io.usd.text_layer import layer_in_parts  # noqa: E402

_MANY = ", ".join(f"{k}: [({k}, 1e-5, -2)]" for k in range(300))
_TEXT = f'''#usda 1.0
(
    doc = """a {{ string, float x.timeSamples = {{ 0: 1, and "quotes' in it \\"" }}"""
    startTimeCode = 0
)
# a comment with " and double y.timeSamples = {{ 0: 1 }}
/* one with float z.timeSamples = {{ 5: 6 }} and ' */
def Xform "a" ( customData = {{ string s = 'it"s {{ }}' }} )
{{
    asset f = @./x{{y.usd@
    asset g = @@@a@b"c@@@
    custom float[] u.timeSamples = {{ 0: [1, 2], 1.5: [3, 4], # a note }}
      2: [5, inf], -1e3: [] , 3: None, }}
    uniform token[] t.timeSamples = {{ 0: ["a}}", "b"] }}
    matrix4d m.timeSamples = {{ 0: ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
        4: ((2,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)) }}
    double3 xformOp:translate.timeSamples={{0:(1,2,3),2:(4,5,6)}}; float w.timeSamples = {{ 0: 1, 2: 3.5, 3: nan }}
    asset h.timeSamples = {{ 0: @x@, }}
    float3[] many.timeSamples = {{
        {_MANY} }}
    variantSet "v" = {{
        "one" {{
            bool q.timeSamples = {{ 0: 1, 1: 0 }}
        }}
        "two" {{
            def "c" {{
                quatf[] q.timeSamples = {{ 0: [(1, 0, 0, 0), (0.5, 0.5, 0.5, 0.5)] }}
            }}
        }}
    }}
}}
def "b" {{
    float u.timeSamples = {{ 0: 9, 7: 8, 7: 9 }}
}}
'''
_DAMAGE = [b"", b"0", b"0", b" ", b" ", b"\n", b"}", b"{", b'"', b"#", b"@", b"]", b"None", b"/*"]
_DECLARED = [b"custom float[] u", b"matrix4d m", b"double3 xformOp:translate", b"float w", b"float3[] many", b"bool q",
             b"quatf[] q", b"float u"]  # fmt: skip


def _whole(text: bytes) -> str | None:
    from pxr import Tf

    layer = Sdf.Layer.CreateAnonymous(".usda")
    try:
        layer.ImportFromString(text.decode())
    except Tf.ErrorException:
        return None
    return str(layer.ExportToString())


@pytest.mark.parametrize("part", [1, 200, 1 << 20])
@pytest.mark.parametrize("name", ["a.usda", "a.usd"])
def test_parts_give_the_layer_of_the_whole(name: str, part: int, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(_TEXT)
    assert [block.declared for block in find_long_samples(path, least=1, part=part)] == _DECLARED
    layer = layer_in_parts(path, long=1, least=1, part=part)
    assert layer is not None
    assert layer.ExportToString() == _whole(_TEXT.encode())
    assert Path(layer.realPath) == path.resolve()  # references are found beside it


@pytest.mark.parametrize("read", [5, 61, 4096])
def test_blocks_do_not_depend_on_what_is_read_together(
    read: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.usda"
    path.write_text(_TEXT)
    wanted = find_long_samples(path, least=1, part=200)
    monkeypatch.setattr("warpjld.io.usd.long_samples._READ", read)
    monkeypatch.setattr("warpjld.io.usd.long_samples._WORD", 40)
    assert find_long_samples(path, least=1, part=200) == wanted


def test_damaged_text_is_left_to_openusd_or_read_alike(tmp_path: Path) -> None:
    path, draw, sound, parted = tmp_path / "a.usda", random.Random(0), _TEXT.encode(), 0
    for _ in range(130):
        text = bytearray(sound)
        for _ in range(draw.choice([1, 1, 3])):
            at = draw.randrange(12, len(text))
            text[at : at + draw.choice([0, 1, 1, 30])] = draw.choice(_DAMAGE)
        path.write_bytes(text)
        layer = layer_in_parts(path, long=1, least=1, part=500)
        if layer is not None:
            parted += 1
            assert layer.ExportToString() == _whole(bytes(text))
    assert 5 < parted < 130  # both ways were taken


def test_openusd_takes_the_layer_without_samples_and_finds_others_beside_it(tmp_path: Path) -> None:
    from pxr import UsdUtils

    path = tmp_path / "a.usda"
    path.write_text(_TEXT.replace("    doc = ", "    subLayers = [@./b.usda@]\n    doc = "))
    (tmp_path / "b.usda").write_text("#usda 1.0\n")
    read = layer_in_parts(path, samples=False, long=1, least=1)
    layers, _, _ = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(path)))
    assert {Path(one.realPath).name for one in layers} == {"a.usda", "b.usda"}
    assert read in layers
    assert not read.ListTimeSamplesForPath("/a.many")


def test_short_texts_and_texts_of_other_things_are_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.usda"
    path.write_text(_TEXT)
    assert layer_in_parts(path) is None
    assert layer_in_parts(path, long=1, least=len(_TEXT)) is None
    path.write_text(_TEXT.replace("many", "u"))  # stated twice
    assert layer_in_parts(path, long=1, least=1) is None

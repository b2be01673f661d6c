"""Small networks as a perception: YOLO-seg exports on a graph built here, and the trained ones where they are."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.perception.box_mask import largest_part, near_depth_mode
from openbelief.perception.boxes import Boxes, survivors
from openbelief.perception.color_word import color_word
from openbelief.perception.detector import APPEARANCE, NANODET, Detector, open_detector
from openbelief.perception.onnx_session import ModelFileError, OnnxModel
from openbelief.perception.yolo_seg import YoloSeg, masks_of

SHARED = Path(__file__).resolve().parents[3].parent / "shared"
MODELS, RECORDINGS = SHARED / "models", SHARED / "recordings"
SIDE, NAMES = 320, {0: "red box", 1: "blue box"}
RED, BLUE = (60, 30, 200, 140), (300, 100, 420, 330)  # x0, y0, x1, y1 in a 640 x 480 frame


def field(number: int, value: int | str | bytes) -> bytes:
    """One protobuf field: a varint, or bytes with their length."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    data = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(data)) + data


def varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value & 127 | 128]), value >> 7
    return out + bytes([value])


def tensor(name: str, array: np.ndarray) -> bytes:
    dims = b"".join(field(1, size) for size in array.shape)
    return dims + field(2, 1) + field(8, name) + field(9, array.astype("<f4").tobytes())


def value_info(name: str, shape: Sequence[int], kind: int = 1) -> bytes:
    """kind: 1 = float32, 10 = float16."""
    dims = b"".join(field(1, field(1, size)) for size in shape)
    return field(1, name) + field(2, field(1, field(1, kind) + field(2, dims)))


def yolo_graph(boxes: np.ndarray, metadata: dict[str, str]) -> bytes:
    """An ONNX ModelProto: boxes (columns, n) as they are; prototypes = means of R, G, B over 4 x 4 pixels, and 1."""
    kernel = np.zeros((4, 3, 4, 4), np.float32)
    kernel[range(3), range(3)] = 1 / 16
    strides = field(1, "strides") + field(8, 4) + field(8, 4) + field(20, 7)
    conv = field(1, "images") + field(1, "kernel") + field(1, "bias") + field(2, "output1") + field(4, "Conv")
    same = field(1, "boxes") + field(2, "output0") + field(4, "Identity")
    weights = {"kernel": kernel, "bias": np.array([0, 0, 0, 1.0]), "boxes": boxes[None]}
    graph = field(1, conv + field(5, strides)) + field(1, same) + field(2, "graph")
    graph += b"".join(field(5, tensor(name, array)) for name, array in weights.items())
    graph += field(11, value_info("images", (1, 3, SIDE, SIDE)))
    graph += field(12, value_info("output0", (1, *boxes.shape)))
    graph += field(12, value_info("output1", (1, 4, SIDE // 4, SIDE // 4)))
    props = b"".join(field(14, field(1, key) + field(2, value)) for key, value in metadata.items())
    return field(1, 8) + field(7, graph) + field(8, field(2, 13)) + props


def row(box: Sequence[float], red: float, blue: float, coefficients: Sequence[float]) -> list[float]:
    """A box of the 640 x 480 frame as the network would say it: letterboxed by 0.5, 40 rows of grey above."""
    x0, y0, x1, y1 = np.array(box) * 0.5 + [0, 40, 0, 40]
    return [(x0 + x1) / 2, (y0 + y1) / 2, x1 - x0, y1 - y0, red, blue, *coefficients]


RED_MASK, BLUE_MASK = (10, -10, 0, -2), (-10, 0, 10, -2)
ROWS = [
    row(BLUE, 0.1, 0.7, BLUE_MASK),
    row(RED, 0.9, 0.0, RED_MASK),
    row(np.add(RED, 4), 0.6, 0.0, RED_MASK),  # the same thing again, less sure
    row((500, 10, 600, 60), 0.2, 0.1, RED_MASK),  # hardly believed
]


@pytest.fixture
def write_yolo(tmp_path) -> Callable[..., Path]:
    def write(metadata: dict[str, str] | None = None, name: str = "toy-seg.onnx") -> Path:
        path = tmp_path / name
        path.write_bytes(yolo_graph(np.array(ROWS).T, {"names": str(NAMES)} if metadata is None else metadata))
        return path

    return write


@pytest.fixture
def frame() -> RgbdFrame:
    color = np.full((480, 640, 3), 128, np.uint8)
    for (x0, y0, x1, y1), rgb in ((RED, (220, 20, 20)), (BLUE, (20, 20, 220))):
        color[y0:y1, x0:x1] = rgb
    return RgbdFrame(0, 1, color, np.ones((480, 640), np.float32), Intrinsics(640, 480, 500, 500, 320, 240), np.eye(4))


def iou(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / max((a | b).sum(), 1))


def test_a_yolo_segmentation_export_gives_the_pixels_of_each_thing_at_the_frames_resolution(write_yolo, frame):
    network = YoloSeg(write_yolo())
    found = network.detect(frame.color)
    assert [network.names[c] for c in found.boxes.classes] == ["red box", "blue box"]  # surest first, no double
    assert found.boxes.scores == pytest.approx([0.9, 0.7])
    np.testing.assert_allclose(found.boxes.xyxy, [RED, BLUE], atol=1e-3)
    for mask, (x0, y0, x1, y1) in zip(masks_of(found, (480, 640)), (RED, BLUE), strict=True):
        truth = np.zeros((480, 640), bool)
        truth[y0:y1, x0:x1] = True
        assert iou(mask, truth) > 0.95


def test_names_beside_the_file_come_before_those_in_it(write_yolo, tmp_path):
    (tmp_path / "toy-seg.names.txt").write_text("crate\n\nbarrel\n")
    assert YoloSeg(write_yolo({})).names == ("crate", "barrel")
    assert YoloSeg(write_yolo()).names == ("crate", "barrel")


@pytest.mark.parametrize(
    ("metadata", "said"),
    [
        ({}, r"no class names: write them into .*toy-seg\.names\.txt"),
        ({"names": "__import__('os').getcwd()"}, "names that cannot be read"),
        ({"names": "{0: 'a', 1: 'b', 2: 'c'}"}, r"gives 10 numbers a box.*make 11: give it the 2 names"),
    ],
)
def test_class_names_that_do_not_fit_the_network_are_refused(write_yolo, metadata, said):
    with pytest.raises(ModelFileError, match=said):
        YoloSeg(write_yolo(metadata))


def test_a_file_that_is_no_network_is_refused_by_name(tmp_path, write_yolo):
    whole = write_yolo().read_bytes()
    cases = {
        "cut-seg.onnx": (whole[: len(whole) // 2], r"cut-seg\.onnx \(\d+ bytes\) cannot be opened"),
        "empty-seg.onnx": (b"", "empty"),
        "page-seg.onnx": (b"<html>404", "a web page"),
        "lfs-seg.onnx": (b"version https://git-lfs.github.com/spec/v1\n", "a Git LFS pointer"),
        "noise-seg.onnx": (struct.pack("<16Q", *range(16)), "cannot be opened"),
    }
    for name, (content, said) in cases.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ModelFileError, match=said) as refused:
            OnnxModel(tmp_path / name)
        assert name in str(refused.value) and "\n" not in str(refused.value)


def test_another_network_than_the_one_asked_for_is_refused_by_name(write_yolo, tmp_path):
    shutil.copy(write_yolo(), tmp_path / NANODET)
    (tmp_path / "toy-seg.onnx").unlink()
    with pytest.raises(ModelFileError, match=rf"{NANODET} is another network than NanoDet"):
        open_detector(tmp_path)
    with pytest.raises(ModelFileError, match=r"input 'picture' and has 'images'|'picture' and has 'images'"):
        OnnxModel(tmp_path / NANODET, inputs={"picture": ()})


def test_half_precision_is_cast_on_the_way_in_and_widened_on_the_way_out(tmp_path):
    graph = field(1, field(1, "x") + field(2, "y") + field(4, "Identity")) + field(2, "graph")
    graph += field(11, value_info("x", (3,), 10)) + field(12, value_info("y", (3,), 10))
    (tmp_path / "half.onnx").write_bytes(field(1, 8) + field(7, graph) + field(8, field(2, 13)))
    model = OnnxModel(tmp_path / "half.onnx")
    [y] = model.run({"x": np.array([0.1, 1.0, 2048.5])})
    assert model.dtype("x") == np.float16 and y.dtype == np.float32
    np.testing.assert_array_equal(y, np.array([0.1, 1.0, 2048.5], np.float16).astype(np.float32))


def test_a_folder_with_several_segmenters_wants_one_named(write_yolo, tmp_path):
    write_yolo(name="a-seg.onnx")
    write_yolo(name="b-seg.onnx")
    with pytest.raises(ModelFileError, match="several segmentation networks"):
        open_detector(tmp_path)
    with pytest.raises(ModelFileError, match=APPEARANCE):  # named: the next thing that is missing
        open_detector(tmp_path / "b-seg.onnx")
    with pytest.raises(ModelFileError, match="not a folder"):
        open_detector(tmp_path / "nowhere")


def test_suppression_is_within_a_class():
    xyxy = np.array([[0, 0, 10, 10], [1, 1, 10, 10], [0, 0, 10, 10], [20, 20, 30, 30]], float)
    boxes = Boxes(xyxy, np.array([0.5, 0.9, 0.4, 0.6]), np.array([1, 1, 2, 1]))
    assert survivors(boxes).tolist() == [1, 3, 2]


@pytest.mark.parametrize(
    ("rgb", "word"),
    [
        ((200, 20, 20), "red"),
        ((120, 75, 40), "brown"),
        ((20, 60, 200), "blue"),
        ((240, 240, 240), "white"),
        ((90, 90, 90), "grey"),
        ((10, 10, 10), "black"),
        ((210, 20, 60), "red"),  # from the other end of the hue circle
        ((30, 150, 40), "green"),
    ],
)
def test_a_thing_of_one_colour_is_called_by_it(rgb, word):
    color = np.full((4, 4, 3), rgb, np.uint8)
    assert color_word(color, np.ones((4, 4), bool)) == word


def test_a_lime_seat_has_a_word_though_a_third_of_it_is_green():
    color = np.full((10, 10, 3), (205, 210, 30), np.uint8)
    color.reshape(-1, 3)[:39] = (150, 215, 30)
    assert color_word(color, np.ones((10, 10), bool)) == "yellow"
    color.reshape(-1, 3)[:39] = (30, 60, 200)  # as much of a far colour: a patchwork
    assert color_word(color, np.ones((10, 10), bool)) is None


def test_a_patchwork_has_no_colour_word():
    color = np.zeros((4, 4, 3), np.uint8)
    color[:2], color[2:] = (200, 20, 20), (20, 60, 200)
    assert color_word(color, np.ones((4, 4), bool)) is None
    assert color_word(color, np.zeros((4, 4), bool)) is None


def test_depth_cuts_off_the_background_and_keeps_what_has_no_depth():
    depth = np.array([[1.0, 1.1, 1.3, 3.0, 0.0]], np.float32)
    assert near_depth_mode(np.ones((1, 5), bool), depth).tolist() == [[True, True, True, False, True]]
    nothing = np.zeros((1, 5), np.float32)
    assert near_depth_mode(np.ones((1, 5), bool), nothing).all()
    parts = np.array([[1, 1, 0, 1]], bool)
    assert largest_part(parts).tolist() == [[True, True, False, False]]


@pytest.fixture(scope="module")
def trained() -> Detector:
    if not (MODELS / NANODET).is_file():
        pytest.skip("the shared models folder is not beside the checkout")
    return open_detector(MODELS, threads=2)


def test_a_segmentation_export_is_a_perception_with_the_appearance_network(write_yolo, frame):
    if not (MODELS / APPEARANCE).is_file():
        pytest.skip("the shared models folder is not beside the checkout")
    folder = write_yolo().parent
    shutil.copy(MODELS / APPEARANCE, folder / APPEARANCE)
    perception = open_detector(folder)
    masks = perception.perceive(frame)
    assert [(mask.phrase, round(mask.confidence, 2)) for mask in masks] == [
        ("red red box", 0.9),
        ("blue blue box", 0.7),
    ]
    assert all(np.linalg.norm(mask.feature) == pytest.approx(1, abs=1e-5) for mask in masks)
    assert not perception.feature_text_aligned and "toy-seg.onnx@" in perception.id


def test_an_empty_picture_has_no_masks(trained):
    blank = np.full((480, 640, 3), 128, np.uint8)
    camera = Intrinsics(640, 480, 500, 500, 320, 240)
    assert trained.perceive(RgbdFrame(0, 1, blank, np.ones((480, 640), np.float32), camera, np.eye(4))) == []


@pytest.mark.recordings
def test_the_trained_networks_see_what_the_recorded_perception_saw(trained):
    """Boxes and scores to the digit; masks by their overlap, since the small mask network hangs on single pixels."""
    from logs.frames.reader import FrameReader
    from openbelief.perception.recorded import RecordedPerception

    if not (RECORDINGS / "kitchen.mcap").is_file():
        pytest.skip("the shared recordings folder is not beside the checkout")
    recorded = RecordedPerception(RECORDINGS / "kitchen.perception.jsonl")
    overlaps, likeness = [], []
    for each in FrameReader(RECORDINGS / "kitchen.mcap", stride=60):
        masks = trained.perceive(each)
        for theirs in recorded.perceive(each):
            ours = [m for m in masks if abs(m.confidence - theirs.confidence) < 1e-3]
            assert [m.phrase.split()[-1] for m in ours] == [theirs.phrase.split()[-1]]
            overlaps.append(iou(ours[0].pixels, theirs.pixels))
            likeness.append(float(ours[0].feature @ theirs.feature))
    assert len(overlaps) > 8 and np.mean(np.array(overlaps) >= 0.5) > 0.7  # 0.9 over the whole file
    assert np.median(likeness) > 0.95

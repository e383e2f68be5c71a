"""The experiment end to end, on made-up images."""

import json
import shutil
from types import SimpleNamespace

import pytest
import torch
from PIL import Image
from safetensors.torch import save_file
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.errors import EnvgenError
from envgen_usd.study import known_networks, study_runs
from envgen_usd.study.known_networks import make_network
from envgen_usd.study.training_exercise import learner_of
from envgen_usd.study.training_options import TrainingOptions

TINY = ("--iterations", 3, "--resolution", "64x48", "--batch", 4, "--rate", 0.01)
FEW = ("--sizes", 6, "--ratios", "0.5,0", "--seeds", 1, "--arms", "mix,real_only", "--folds", 2)


def study(*words):
    result = CliRunner().invoke(app, ["study", "mix", *(str(word) for word in words)])
    if isinstance(result.exception, EnvgenError):
        raise result.exception
    assert result.exit_code == 0, result.output + str(result.exception)
    return result.output


@pytest.fixture(scope="module")
def sources(real_folder, frames_folder):
    return ("--real", real_folder, "--synthetic", frames_folder)


@pytest.fixture(scope="module")
def whole(sources, tmp_path_factory):
    out = tmp_path_factory.mktemp("study") / "whole"
    study(
        *sources,
        "--out",
        out,
        "--sizes",
        6,
        "--ratios",
        "1,0.5,0",
        "--seeds",
        1,
        "--folds",
        2,
        *TINY,
    )
    return out


@pytest.fixture(scope="module")
def small(sources, tmp_path_factory):
    out = tmp_path_factory.mktemp("study") / "small"
    study(*sources, "--out", out, *FEW, *TINY)
    return out


def results(out):
    """Scores of every run, without times."""
    found = {}
    for path in sorted((out / "runs").glob("*.json")):
        content = json.loads(path.read_text("utf-8"))
        found[path.name] = (content["images"], content["counts"], content["curve"])
    return found


def test_a_study_writes_tables_charts_pictures_and_a_report(whole):
    text = (whole / "table.md").read_text("utf-8")
    assert "0002B+0003C" in text
    for arm in ("mix", "real_only", "oversampled", "flat", "plain", "added"):
        assert f"| {arm} |" in text
    assert "\\toprule" in (whole / "table.tex").read_text("utf-8")
    head, *rows = (whole / "table.csv").read_text("utf-8").splitlines()
    assert head.startswith('"real / synthetic')
    assert [row.split(",")[0] for row in rows] == ["100 / 0", "50 / 50", "0 / 100"]
    page = (whole / "report.html").read_text("utf-8")
    assert "Confusion matrices" in page
    for name in ("learning_curves", "ratio", "pareto"):
        assert (whole / "figures" / f"{name}.svg").read_text("utf-8").startswith("<svg")
    shown = next((whole / "runs").glob("*.jpg"))
    with Image.open(shown) as sheet:
        assert sheet.size == (3 * 64, 4 * 48)


def test_the_sequence_that_is_scored_is_never_trained_on(whole):
    for path in (whole / "runs").glob("*.json"):
        content = json.loads(path.read_text("utf-8"))
        fold = content["run"]["fold"]
        scored = {name.split("/")[0] for name in content["images"]}
        assert scored == (set(fold.split("+")) if fold else {"0001A", "0002B", "0003C"})
        assert bool(fold) == bool(content["run"]["real"])


def test_a_killed_study_goes_on_and_ends_with_the_same_results(
    small, sources, tmp_path, monkeypatch
):
    real_run, done = study_runs._carry_out, []

    def killed_after_two(*job):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(job)
        real_run(*job)

    monkeypatch.setattr(study_runs, "_carry_out", killed_after_two)
    CliRunner().invoke(app, ["study", "mix", *map(str, (*sources, "--out", tmp_path, *FEW, *TINY))])
    monkeypatch.setattr(study_runs, "_carry_out", real_run)
    assert len(list((tmp_path / "runs").glob("*.json"))) == 2
    assert "2 kept" in study(*sources, "--out", tmp_path, *FEW, *TINY)
    assert results(tmp_path) == results(small)


def test_shards_together_are_the_whole(small, sources, tmp_path):
    first = study(*sources, "--out", tmp_path, *FEW, *TINY, "--shard", "1/2")
    assert "runs are missing" in first
    study(*sources, "--out", tmp_path, *FEW, *TINY, "--shard", "2/2")
    assert results(tmp_path) == results(small)
    assert (tmp_path / "table.csv").read_text() == (small / "table.csv").read_text()


def test_the_preset_article_runs_with_a_random_split_on_small_numbers(sources, tmp_path):
    text = study(
        *sources, "--out", tmp_path, "--preset", "article", "--network", "small", "--sizes", "4",
        "--ratios", "1,0", "--seeds", 2, "--epochs", 1, *TINY[2:],
    )  # fmt: skip
    assert "4 trained" in text
    assert "random" in (tmp_path / "table.md").read_text("utf-8")


@pytest.mark.parametrize(
    "words",
    [
        ("--adapt", "colour", "--class-weights", "root", "--balanced"),
        ("--adapt", "fourier", "--schedule", "finetune", "--augment", "flip,light,framing"),
        ("--class-weights", "inverse", "--batches", "proportional", "--augment", "none"),
    ],
)
def test_knobs_of_training_run_in_every_arm(sources, tmp_path, words):
    few = ("--sizes", 4, "--ratios", "0.5,0", "--seeds", 1, "--folds", 2)
    study(*sources, "--out", tmp_path, *few, *TINY[2:], "--iterations", 2, *words)
    assert (tmp_path / "report.html").is_file()


def test_bad_input_is_named(sources, tmp_path, real_folder, frames_folder):
    out = ("--out", tmp_path / "out")
    cases = {
        "--real .*gone: no such folder": (
            "--real",
            tmp_path / "gone",
            "--synthetic",
            frames_folder,
        ),
        "has none of the folders": ("--real", frames_folder, "--synthetic", frames_folder),
        "--synthetic .*: is a file, not a folder": (
            *("--real", real_folder, "--synthetic", real_folder / "images/train/0001A_00001.png"),
        ),
        "holds no frames": ("--real", real_folder, "--synthetic", real_folder),
        "--sizes 900": (*sources, "--sizes", 900),
        "'many' is no number": (*sources, "--sizes", "many"),
        "from 0 to 1": (*sources, "--ratios", "2"),
        "--arms best": (*sources, "--arms", "best"),
        "--network huge": (*sources, *FEW, *TINY, "--network", "huge"),
        "--augment magic": (*sources, "--augment", "magic"),
        "multiples of 16": (*sources, "--resolution", "50x50"),
        "--unlabelled: has no effect without --adapt": (*sources, "--unlabelled", 9),
        "--iterations: has no effect with --epochs 300": (
            *(*sources, "--preset", "article", "--network", "small", "--iterations", 9),
        ),
        "--folds: has no effect with a random split": (
            *(*sources, "--split", "random", "--folds", 2),
        ),
    }
    for text, words in cases.items():
        with pytest.raises(EnvgenError, match=text):
            study(*words, *out)


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """A folder with files of weights, and files that are none."""
    folder = tmp_path_factory.mktemp("weights")
    state = make_network("small").state_dict()
    first, *_, last = state
    whole = {name: values.contiguous() for name, values in state.items()}
    save_file(whole, folder / "ok.safetensors")
    torch.save(state, folder / "ok.pt")
    torch.save({**state, first: state[first][:, :1]}, folder / "shape.pt")
    torch.save({name: state[name] for name in state if name != last}, folder / "less.pt")
    torch.save({**state, "head.more": state[first]}, folder / "more.pt")
    torch.save({**state, first: state[first] / 0.0}, folder / "infinite.pt")
    torch.save([state], folder / "list.pt")
    torch.save({1: state[first]}, folder / "numbers.pt")
    (folder / "cut.pt").write_bytes((folder / "ok.pt").read_bytes()[:999])
    (folder / "folder.pt").mkdir()
    for name in ("empty.pt", "empty.safetensors"):
        (folder / name).touch()
    (folder / "text.pt").write_text("weights of a network")
    Image.new("RGB", (8, 8)).save(folder / "picture.png")
    return folder


NO_WEIGHTS = "is no file of weights, or damaged"


@pytest.mark.parametrize(
    ("name", "match"),
    [
        ("none.pt", "no such file; name a file of first weights"),
        ("folder.pt", "is a folder, not a file"),
        ("empty.pt", NO_WEIGHTS),
        ("empty.safetensors", NO_WEIGHTS),
        ("text.pt", NO_WEIGHTS),
        ("picture.png", NO_WEIGHTS),
        ("cut.pt", NO_WEIGHTS),
        ("list.pt", NO_WEIGHTS),
        ("numbers.pt", NO_WEIGHTS),
        ("shape.pt", r"another network: tensor stem.0.weight is 16 x 1 x 3 x 3, not 16 x 3 x 3 x"),
        ("less.pt", r"another network: it lacks the tensor \S+;"),
        ("more.pt", "another network: it holds the tensor head.more, which the network lacks"),
        ("infinite.pt", "tensor stem.0.weight holds values that are not finite"),
    ],
)
def test_first_weights_that_do_not_fit_are_named(name, match, weights, sources, tmp_path):
    with pytest.raises(EnvgenError, match=f"--weights {weights / name}: .*{match}"):
        study(*sources, "--out", tmp_path / "out", "--weights", weights / name)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["ok.pt", "ok.safetensors"])
def test_a_network_takes_first_weights(name, weights):
    wanted = torch.load(weights / "ok.pt", weights_only=True)
    state = make_network("small", str(weights / name)).state_dict()
    assert all(torch.equal(state[key], wanted[key]) for key in wanted)


def test_weights_of_torchvision_have_its_names(tmp_path, monkeypatch):
    """A stand-in for the library, whose networks answer with a dictionary."""
    made = torch.nn.Conv2d(3, 7, 1)
    torch.save(made.state_dict(), tmp_path / "weights.pt")
    library = SimpleNamespace(tiny=lambda **_: torch.nn.Conv2d(3, 7, 1))
    monkeypatch.setattr(known_networks, "_library", lambda *_: library)
    network = make_network("torchvision:tiny", str(tmp_path / "weights.pt"))
    state = list(network.state_dict().values())
    assert all(map(torch.equal, state, made.state_dict().values()))


@pytest.mark.parametrize(
    ("name", "match"),
    [("none.pt", "no such file"), ("folder.pt", "is a folder"), ("text.pt", NO_WEIGHTS)],
)
def test_first_weights_of_yolo_are_checked_before_the_work(name, match, weights, monkeypatch):
    monkeypatch.setattr("envgen_usd.study.yolo_learner.find_spec", lambda _: object())
    with pytest.raises(EnvgenError, match=f"--weights {weights / name}: {match}"):
        learner_of(TrainingOptions(network="yolov8n", weights=str(weights / name)))


def test_a_learning_rate_has_no_effect_with_yolo(monkeypatch):
    monkeypatch.setattr("envgen_usd.study.yolo_learner.find_spec", lambda _: object())
    with pytest.raises(EnvgenError, match="--rate: has no effect with --network yolov8n"):
        learner_of(TrainingOptions(network="yolov8n", rate=0.01))


def test_yolo_needs_its_extra(sources, tmp_path, monkeypatch):
    monkeypatch.setattr("envgen_usd.study.yolo_learner.find_spec", lambda _: None)
    with pytest.raises(EnvgenError, match="needs ultralytics"):
        study(*sources, "--out", tmp_path, "--preset", "article")


def test_other_synthetic_images_keep_what_real_images_alone_gave(small, sources, tmp_path):
    shutil.copytree(small, tmp_path / "study")
    frames = tmp_path / "frames"
    shutil.copytree(sources[3], frames)
    for kind in ("rgb", "semantic"):
        next((frames / kind).iterdir()).unlink()
    before = results(small)
    words = (*sources[:3], frames, "--out", tmp_path / "study", *FEW, *TINY)
    text = study(*words)
    real_alone = [name for name in before if "syn" not in name]
    assert real_alone
    assert f"{len(real_alone)} kept" in text
    after = results(tmp_path / "study")
    assert before.items() < after.items()  # the old ones, and new ones of the other images


def test_a_folder_keeps_its_study(small, sources):
    with pytest.raises(EnvgenError, match="holds another study: iterations was 3"):
        study(*sources, "--out", small, *FEW, *TINY[2:], "--iterations", 13)


def test_a_folder_of_a_build_is_no_folder_of_a_study(sources, tmp_path):
    (tmp_path / "chunks").mkdir()
    with pytest.raises(EnvgenError, match="holds the environment of a build; choose another"):
        study(*sources, "--out", tmp_path, *FEW, *TINY)
    assert [*tmp_path.iterdir()] == [tmp_path / "chunks"]


@pytest.mark.parametrize("content", [" ", "[]", '{"mark": 1}'])
def test_a_damaged_mark_is_named(small, sources, tmp_path, content):
    out = tmp_path / "study"
    shutil.copytree(small, out)
    (out / "study.json").write_text(content)
    with pytest.raises(EnvgenError, match=rf"{out}/study.json: does not tell"):
        study(*sources, "--out", out, *FEW, *TINY)
    (out / "study.json").unlink()
    study(*sources, "--out", out, *FEW, *TINY)
    assert results(out) == results(small)

"""examples/design_from_rest on a few recordings, where they are at hand."""

import numpy as np
import pytest

import motion_rule
import rest_rule
import rest_trials

needs_recordings = pytest.mark.skipif(
    not any(rest_trials.RECORDINGS.glob("*.parquet")),
    reason="no recordings: set COMPFILT_RECORDINGS to a folder of them",
)

CHOSEN = ("03_undisturbed_slow_rotation_C", "25_disturbed_tapping_B")


@pytest.fixture(scope="module", params=CHOSEN)
def trial(request):
    return rest_trials.read(rest_trials.RECORDINGS / f"{request.param}.parquet")


@needs_recordings
def test_the_noise_explains_the_rest_and_not_the_motion(trial):
    chosen = rest_rule.by_spectra(trial)
    rest, motion, warnings = rest_rule.explained(trial, chosen.design)
    assert rest == pytest.approx(1.0, abs=0.05)
    assert motion > 10.0
    assert "motion or vibration is in the measurement" in warnings[0]
    assert chosen.design.tau == pytest.approx(rest_rule.by_densities(trial).design.tau, rel=0.6)


@needs_recordings
def test_the_offline_estimate_chooses_nearly_the_best(trial):
    best = motion_rule.error(trial, motion_rule.with_truth(trial).design)
    assert motion_rule.error(trial, motion_rule.with_the_offline_estimate(trial).design) < 1.02 * best
    at_rest = motion_rule.error(trial, rest_rule.by_spectra(trial).design)
    assert at_rest > (1.5 if "tapping" in trial.name else 1.0) * best


def test_without_recordings_it_says_so(load_example, monkeypatch, tmp_path, capsys):
    example = load_example("design_from_rest")
    monkeypatch.setattr(example, "RECORDINGS", tmp_path)
    example.main()
    assert capsys.readouterr().out == f"NO RECORDINGS in {tmp_path}: nothing is reproduced\n"


def test_horizontal_components_are_those_of_the_rotation():
    """A turn of 90° about x takes the body's y to the world's z, its z to the world's -y."""
    half = np.sqrt(0.5)
    turned = motion_rule.horizontal(np.array([[half, half, 0.0, 0.0]]), np.array([[1.0, 2.0, 3.0]]))
    np.testing.assert_allclose(turned, [[1.0, -3.0]], atol=1e-12)

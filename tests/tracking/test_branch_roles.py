"""Branches of an object are told apart by their role in it, as in the last frame of the same structure."""

from __future__ import annotations

import pickle

import cv2
import numpy as np

import dloftbs
from dloftbs import Pipeline
from dloftbs.tracking.branch_roles import BranchRoles, ends_that_meet, match_roles
from dloftbs.tracking.observation import Observation, make_observations
from dloftbs.tracking.track_model import TrackModel

LINES = ((40, 240), (600, 240)), ((200, 240), (300, 60)), ((400, 240), (500, 420))


def mask_of(shift: int, lines: int = 3) -> np.ndarray:
    mask = np.zeros((480, 1280), np.uint8)
    for start, stop in LINES[:lines]:
        cv2.line(mask, (start[0] + shift, start[1]), (stop[0] + shift, stop[1]), (255,), 12)
    return mask


def observations_of(shift: int, lines: int = 3) -> list[Observation]:
    return list(make_observations(list(dloftbs.detect(mask_of(shift, lines), branched=True))))


def test_a_harness_that_jumps_keeps_the_ids_of_its_branches() -> None:
    pipeline = Pipeline(branched=True)
    for _ in range(5):
        before = pipeline.process(mask_of(0))
    after = pipeline.process(mask_of(250))
    assert sorted(track.id for track in after.tracks) == sorted(track.id for track in before.tracks)
    places = {track.id: track.curve(0.5) + np.array([250.0, 0.0]) for track in before.tracks}
    for track in after.tracks:
        assert np.hypot(*(track.curve(0.5) - places[track.id])) < 6.0


def test_pairs_are_those_of_the_same_role_and_none_where_a_branch_is_missing() -> None:
    seen = observations_of(0)
    models = [TrackModel.from_observation(number, one) for number, one in enumerate(seen, start=1)]
    roles = {model.id: ends_that_meet(one) for model, one in zip(models, seen, strict=True)}
    assert sorted(roles.values()) == [1, 1, 1, 1, 2]
    pairs = match_roles(models, observations_of(30)[::-1], roles)
    assert {model.id: ends_that_meet(one) for model, one in pairs} == roles
    assert match_roles(models, observations_of(30, 2), roles) == []
    assert match_roles(models[1:], observations_of(30), roles) == []


def test_roles_are_those_of_the_last_frame_with_the_same_structure() -> None:
    pipeline, known = Pipeline(branched=True), BranchRoles()
    result = pipeline.process(mask_of(0))
    assert known.known(observations_of(0)) == {}
    known.record(make_observations(list(result)), result.tracks, {track.id for track in result.tracks})
    assert sorted(known.known(observations_of(0))) == [track.id for track in result.tracks]
    assert known.known(observations_of(0, 2)) == {}
    assert known.known(observations_of(0, 1)) == {}


def test_roles_are_kept_of_tracks_that_run_against_their_detections() -> None:
    result, known = Pipeline(branched=True).process(mask_of(0)), BranchRoles()
    held = {track.id for track in result.tracks}
    known.record(make_observations([one.reversed() for one in result]), result.tracks, held)
    assert sorted(known.known(observations_of(0))) == [track.id for track in result.tracks]


def test_roles_are_forgotten_with_the_first_of_their_tracks() -> None:
    result, known = Pipeline(branched=True).process(mask_of(0)), BranchRoles()
    held = {track.id for track in result.tracks}
    known.record(make_observations(list(result)), result.tracks, held)
    known.record([], [], held | {99})
    assert known.known(observations_of(0))
    known.record([], [], held - {1})
    assert known.known(observations_of(0)) == {}
    assert len(pickle.dumps(known)) == len(pickle.dumps(BranchRoles()))

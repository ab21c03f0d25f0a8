"""Values that are marked as missing: their readings are left out, and the result tells how many and where."""

import numpy as np
import pytest

import abbe

C = np.arange(0.0, 360.0)
OFFSET_MM = 0.012
LENGTH = np.hypot(np.hypot(OFFSET_MM - 100 * np.sin(np.radians(C)), 100 * np.cos(np.radians(C))), 75.0)
BAR = {"bar_mm": 125, "workpiece_ball_mm": (0, 100, 0), "spindle_ball_mm": (0, 0, 0), "z_mm": 75}
GAPS = [7, 8, 9, 200]
TOLD = 'test "C": 4 of 360 readings are missing: `length_mm` items 7 to 9, 200'
# A value that no one measured: a reading that is not left out shifts the estimates.
WRONG = np.where(np.isin(C, GAPS), LENGTH + 0.05, LENGTH)


def fitted(**columns):
    session = abbe.Session("w C A b Y X Z t", noise_um=0.1, errors=["EX0C", "EY0C"])
    session.add_test("C", **BAR, **{"c_deg": C, **columns})
    return session, session.fit()


def masked():
    return np.ma.masked_array(WRONG, mask=np.isin(C, GAPS))


def with_none():
    return [None if item in GAPS else value for item, value in enumerate(WRONG.tolist())]


def with_masked_items():
    return [np.ma.masked if item in GAPS else value for item, value in enumerate(WRONG.tolist())]


def objects():
    return np.array(with_none(), dtype=object)


def series_with_nan():
    pandas = pytest.importorskip("pandas")
    return pandas.Series(np.where(np.isin(C, GAPS), np.nan, LENGTH))


def series_with_na():
    pandas = pytest.importorskip("pandas")
    return pandas.Series(with_none(), dtype="Float64")


def list_with_na():
    pandas = pytest.importorskip("pandas")
    return [pandas.NA if item in GAPS else value for item, value in enumerate(WRONG.tolist())]


def polars_series():
    return pytest.importorskip("polars").Series(with_none())


def arrow_array():
    return pytest.importorskip("pyarrow").array(with_none())


def arrow_chunks():
    pyarrow = pytest.importorskip("pyarrow")
    values = with_none()
    return pyarrow.chunked_array([values[:100], values[100:]])


@pytest.mark.parametrize(
    "column",
    [
        masked, with_none, with_masked_items, objects, series_with_nan, series_with_na, list_with_na, polars_series,
        arrow_array, arrow_chunks,
    ],
)
def test_marked_readings_are_left_out_and_told(column):
    session, fit = fitted(length_mm=column())
    assert fit.readings == 356
    assert session.warnings == (TOLD,)
    assert TOLD in fit.warnings and TOLD in fit.to_dict()["warnings"]
    assert fit["EX0C"].value == pytest.approx(1e3 * OFFSET_MM, abs=1e-3)
    assert session.readings("C")["reading_mm"].tolist() == np.delete(LENGTH, GAPS).tolist()
    assert np.allclose(session.readings("C")["c_deg"], np.delete(C, GAPS))
    assert len(fit.residuals["C"]) == 356


def test_a_position_and_a_socket_may_be_missing():
    positions = np.ma.masked_equal(C, 20.0)
    session, fit = fitted(c_deg=positions, length_mm=masked())
    assert fit.readings == 355
    assert session.warnings == (
        'test "C": 5 of 360 readings are missing: `c_deg` item 20; `length_mm` items 7 to 9, 200',
    )
    one, _ = fitted(length_mm=np.ma.masked_array(LENGTH, mask=C == 3))
    assert one.warnings == ('test "C": 1 of 360 readings is missing: `length_mm` item 3',)


def test_a_mask_without_marks_is_an_array():
    session, fit = fitted(length_mm=np.ma.masked_array(LENGTH))
    assert fit.readings == 360 and session.warnings == ()


def test_saved_and_pickled_sessions_have_the_readings_that_are_left(tmp_path):
    import pickle

    session, fit = fitted(length_mm=masked())
    assert pickle.loads(pickle.dumps(session)).fit().to_dict() == fit.to_dict()
    again = abbe.Session(session.save(tmp_path / "saved"))
    assert again.fit()["EX0C"].value == pytest.approx(fit["EX0C"].value, abs=1e-6)


@pytest.mark.parametrize(
    ("length", "words"),
    [
        (np.where(C == 7, np.nan, LENGTH), ["length_mm", "NaN", "item 7"]),
        (np.where(C == 7, np.nan, LENGTH).tolist(), ["length_mm", "NaN", "item 7"]),
        # The mask hides item 3; item 7 is NaN and is not masked.
        (np.ma.masked_array(np.where(C == 7, np.nan, LENGTH), mask=C == 3), ["length_mm", "NaN", "item 7"]),
        (np.ma.masked_array(LENGTH, mask=True), ["360 of 360 readings are missing"]),
        ([None] * 360, ["360 of 360 readings are missing"]),
        (np.ma.masked_array(LENGTH.reshape(2, 180), mask=True), ["`length_mm`", "2 dimensions"]),
    ],
)
def test_what_is_not_marked_is_not_missing(length, words):
    with pytest.raises(abbe.SessionError) as caught:
        fitted(length_mm=length)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_none_states_nothing():
    session, fit = fitted(length_mm=LENGTH, bar_u_um=None, setup=None, time_s=None)
    assert fit.to_dict() == fitted(length_mm=LENGTH)[1].to_dict()
    session.add_effect(component="EZC", driver="C", shape="harmonic", order=2, tests=None)
    assert session.effects == ("EZC~C:h2",)


def test_commands_and_parameters_cannot_be_missing():
    session, fit = fitted(length_mm=LENGTH)
    model = fit.model()
    half = np.ma.masked_array([1.0, 2.0], mask=[False, True])
    for call in (
        lambda: model.compensate({"x_mm": half}),
        lambda: model.compensate({"x_mm": [1.0, None]}),
        lambda: model.pose_errors({"x_mm": half}),
        lambda: model.compensate({"x_mm": [1.0, 2.0]}, time_s=half),
        lambda: session.predict(half),
    ):
        with pytest.raises(abbe.SessionError, match="1 of 2 values are missing, the first in item 1"):
            call()

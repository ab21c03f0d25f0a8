"""Tables, figures, and the exchange with other packages."""

import numpy as np
import pytest

import abbe


@pytest.fixture(scope="module")
def results():
    from conftest import MEASURED, PLANS, SESSIONS

    session = abbe.Session.read(SESSIONS / MEASURED[0])
    fit, trace = session.fit(), session.trace(only=["EZC"], max_effects=1)
    plan = abbe.Session.read(SESSIONS / PLANS[1]).plan(effects=False)
    return [fit, trace, plan, trace.model().validate(session)]


def test_tables(results):
    pandas, polars, pyarrow = map(pytest.importorskip, ("pandas", "polars", "pyarrow"))
    for result in results:
        assert "<table>" in result._repr_html_() and str(result)
        table = result.table
        frame = table.to_pandas()
        assert isinstance(frame, pandas.DataFrame) and len(frame) == len(table) > 0
        assert pyarrow.table(table).num_rows == len(table)
        assert polars.DataFrame(table).height == len(table)
    estimates = results[0].table.to_pandas().set_index("parameter")
    assert estimates.loc["EX0C", "value"] == results[0]["EX0C"].value
    rows = results[0].residual_table().to_pandas()
    assert len(rows) == sum(results[0].residuals[test].shape[0] for test in results[0].residuals)


def test_print_and_notebook_show_the_report(results):
    fit, trace, plan, validation = results
    # What the command prints: goodness of fit, verdict, what is identifiable.
    assert "Goodness of fit: " in str(fit) and "χ²/ν" in str(fit) and "numerical rank" in str(fit)
    assert f"Verdict: {trace.verdict}" in str(trace) and "EZC" in str(trace)
    assert "worst determined" in str(plan) and f"Verdict: {validation.verdict}" in str(validation)
    for result in results:
        text, page = str(result), result._repr_html_()
        for words in ("What to correct: ", "What to measure next: "):
            assert words in text and words in page, words
        # `further` only where there is more than lines of axes to correct.
        assert set(result.statements.to_dict()) - {"further", "changed"} == {"good", "correct", "measure"}
        assert "<script" not in page and "<svg" not in page
        for words in ("worst determined", "Goodness of fit", "indistinguishable", "inside the range"):
            assert (words in text) == (words in page), words


def test_estimates_agree_with_the_refusals():
    c_deg = np.arange(0.0, 360.0, 10.0)
    c = np.radians(c_deg)
    # A circle of one height cannot tell a tilt of the axis from its offset.
    session = abbe.Session("w C A b Y X Z t", noise_um=0.1, errors=["EX0C", "EY0C", "EB0C"])
    bar = {"bar_mm": 125, "workpiece_ball_mm": (0, 100, 0), "spindle_ball_mm": (0, 0, 0), "z_mm": 75}
    length_mm = np.hypot(np.hypot(0.012 - 100 * np.sin(c), 100 * np.cos(c)), 75.0)
    session.add_test("C", **bar, c_deg=c_deg, length_mm=length_mm)
    fit = session.fit()
    ids = [parameter.id for parameter in session.parameters]
    refused = [id for id, estimate in zip(ids, fit.estimates) if np.isnan(estimate)]
    assert "EX0C" in refused and "EY0C" not in refused and np.isfinite(fit.solution).all()
    for id, estimate in zip(ids, fit.estimates):
        if id in refused:
            with pytest.raises(KeyError, match="no estimate of"):
                fit[id]
        else:
            assert fit[id].value == pytest.approx(estimate, rel=1e-9, abs=1e-9)
    # Predictions need the whole of it.
    assert session.predict(fit) == pytest.approx(length_mm, abs=1e-4)


@pytest.mark.parametrize(
    "guess, ours",
    [
        ("params", "use parameters"),
        ("summary", r"use print\(result\)"),
        ("chi2", "use chi_square"),
        ("to_pandas", r"use table\.to_pandas\(\)"),
        ("sensitivities", "no attribute 'sensitivities'"),
    ],
)
def test_guesses_lead_on(results, guess, ours):
    with pytest.raises(AttributeError, match=ours):
        getattr(results[0], guess)
    assert not hasattr(results[0], guess)


@pytest.mark.parametrize("noise_um, why", [(0.01, "less than a tenth of the noise"), (0.1, "far below the noise")])
def test_a_residual_below_the_noise_is_not_judged(chapter5, tmp_path, noise_um, why):
    file = chapter5.simulate({"EY0A": 30.0}, seed=3, noise_um=noise_um).save(tmp_path / "run")
    file.write_text(file.read_text().replace(f"noise_um = {noise_um}", "noise_um = 0.3"))
    shown = str(abbe.Session.read(file).fit())
    opening = shown[: shown.index("readings, noise 0.300")]
    assert "not judged" in opening and why in opening and "What to correct: nothing;" not in opening, opening


def test_compare_and_export(results, tmp_path):
    fit = results[0]
    found = abbe.compare(fit, fit.model(), names=["first", "again"], places=3)
    assert found.models == ("first", "again") and not any(pair.significant for pair in found.pairs)
    # The fit lacks an effect: its differences are not judged.
    assert "not judged" in str(found) and found.figures
    found.report(tmp_path / "compare.html")
    with pytest.raises(TypeError, match="at least two"):
        abbe.compare(fit)
    text = fit.model().export("urdf", tmp_path / "machine.urdf")
    assert text.startswith("<?xml") and (tmp_path / "machine.urdf").read_text() == text
    model = fit.model()
    best, plain = (model.export("linuxcnc", entries=word) for word in ("best", "plain"))
    wide = model.export("linuxcnc", travel={"A": (-90, 90)})
    assert len({best, plain, wide}) == 3
    with pytest.raises(abbe.Error, match="the choices are best, plain"):
        model.export("linuxcnc", entries="all")
    with pytest.raises(ValueError, match="`travel` belongs to"):
        model.export("urdf", travel={"A": (-90, 90)})
    with pytest.raises(abbe.Error, match="has no axis `B`"):
        model.export("linuxcnc", travel={"B": (-90, 90)})
    with pytest.raises(abbe.Error, match="not below the second"):
        model.export("linuxcnc", travel={"A": (90, -90)})
    with pytest.raises(abbe.Error, match="the formats are table"):
        fit.model().export("nothing")
    with pytest.raises(ValueError, match="`places` belongs to"):
        model.export("urdf", places=5)


def test_compensation_tables_of_a_model(tmp_path):
    """A table of LinuxCNC holds the commanded position and where the axis stands: together they give the error."""
    plan = {
        "machine": {"chain": "w C b X Y Z t", "axis": {name: {} for name in "CXYZ"}},
        "instrument": {"kind": "ballbar", "noise_um": 0.1},
        "unknowns": {"errors": ["EX0C"]},
        "effect": [{"component": "EXX", "shape": "polynomial", "order": 2}],
        "test": [
            {
                "name": name,
                "bar_mm": 100,
                "workpiece_ball_mm": [x, 0, 0],
                "spindle_ball_mm": [0, 0, 0],
                "path": {"kind": "circle", "plane": "XY", "radius_mm": 100, "step_deg": 2},
            }
            for name, x in (("XY", 0), ("off centre", 60))
        ],
    }
    session = abbe.Session(plan).simulate({"EX0C": "3um", "EXX~X:p2.1": "6um", "EXX~X:p2.2": "-3um"}, seed=3)
    fit = session.fit()
    files = fit.model().export("linuxcnc-tables", tmp_path / "tables", places=11)
    assert set(files) == {"X.comp", "uncertainty.csv"}
    assert (tmp_path / "tables" / "X.comp").read_text() == files["X.comp"]
    rows = [line.split() for line in files["X.comp"].splitlines()]
    assert len(rows) == 11
    for row in rows:
        at, actual = float(row[0]), float(row[1])
        expected = fit["EXX~X:p2.1"].value * at / 100 + fit["EXX~X:p2.2"].value * (at / 100) ** 2
        assert (actual - at) * 1e3 == pytest.approx(expected, abs=2e-3)


def test_figures(results):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    for result in results:
        assert result.figures
        for figure in {figure._handle.kind: figure for figure in result.figures}.values():
            assert figure._repr_html_().startswith("<figure>") and "<svg" in figure.svg()
            axes = figure.plot()
            assert axes.get_title() == figure.title
            axes.figure.canvas.draw()
            plt.close(axes.figure)
        assert result.plot(result.figures[0].name).get_title() == result.figures[0].title
        plt.close("all")
    with pytest.raises(KeyError, match="no figure"):
        results[0].plot("nothing")


def test_reports(results, tmp_path):
    for number, result in enumerate(results):
        result.report(tmp_path / f"{number}.html")
        assert (tmp_path / f"{number}.html").read_text().rstrip().endswith("</html>")
    assert len(list(tmp_path.iterdir())) == len(results)


def test_matrices(results):
    fit = results[0]
    covariance = np.asarray(fit.covariance)
    assert covariance.shape == (len(fit.parameters),) * 2
    assert np.asarray(fit.null_space).shape[1:] in ((0,), (len(fit.null_space.ids),), ())
    plan = results[2]
    assert plan.uncertainty.shape == plan.identifiable.shape == (len(plan.ids),)

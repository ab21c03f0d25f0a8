"""Digital calibration certificates of `abbe fit --dcc`: its figures, its units by another program, the schema of PTB."""

import os
import xml.etree.ElementTree as tree
from pathlib import Path

import pytest
from conftest import SESSIONS

import abbe

EXAMPLE = """[certificate]
id = "2026-0042"
country = "DE"
begin = "2026-11-23"
end = "2026-11-24"
language = "de"
place = "laboratory"

[item]
manufacturer = "Hermle"
model = "C 600 U"
serial_number = "17-331"

[laboratory]
name = "Messlabor Süd"
street = "Hauptstraße 1"
post_code = "70173"
city = "Stuttgart"
country = "DE"
email = "labor@example.org"
phone = "+49 711 1"
code = "D-K-00000"

[customer]
name = "Müller & Söhne"
city = "Ulm"
email = "pruefung@example.com"

[[person]]
name = "A. Example"
role = "head"
signs = true

[[equipment]]
name = "ball bar"
manufacturer = "R & Co"
model = "Q"
serial_number = "B 1234"
certificate = "2026-0007"

[conditions]
temperature_c = [19.6, 20.3]
"""


@pytest.fixture
def certificate(tmp_path, command):
    """The file of a certificate, and the fit."""
    plan = abbe.Session.read(SESSIONS / "hermle-c600u" / "chapter5.toml")
    folder = tmp_path / "run1"
    plan.simulate({"EX0C": 12.0, "EB0A": -1.5}, seed=1, draw_setups=True).save(folder)
    session = folder / "session.toml"
    session.write_text(session.read_text() + "\n[tolerance]\nerrors.EX0C_um = 5\nerrors.EY0A_um = 30\n")
    (folder / "certificate.toml").write_text(EXAMPLE, encoding="utf-8")
    file = tmp_path / "certificate.xml"
    command("fit", session, "--dcc", file, "--quiet", json=False)
    return file, abbe.Session.read(session).fit()


NAMES = {"si": "https://ptb.de/si", "dcc": "https://ptb.de/dcc"}


def test_its_figures_are_those_of_the_fit_in_units_of_d_si(certificate):
    units_of_d_si = pytest.importorskip("dsi_unit")
    file, fit = certificate
    root = tree.parse(file).getroot()
    assert root.findtext(".//dcc:uniqueIdentifier", namespaces=NAMES) == "2026-0042"
    laboratory = root.find("dcc:administrativeData/dcc:calibrationLaboratory", NAMES)
    assert laboratory.findtext("dcc:contact/dcc:name/dcc:content", namespaces=NAMES) == "Messlabor Süd"
    found = {}
    for real in root.findall(".//dcc:result//si:real", NAMES):
        text = {child.tag.split("}")[1]: child for child in real}
        u = float(text["expandedUnc"].find("si:uncertainty", NAMES).text)
        found[text["label"].text] = (float(text["value"].text), u, text["unit"].text)
    units = {"um": r"\micro\metre", "arcsec": r"\arcsecond"}
    certified = [own for own in fit.parameters if "[" not in own.id]
    assert found == {own.id: (own.value, own.expanded_u, units[own.unit]) for own in certified}
    assert all(units_of_d_si.DsiUnit(own.text).valid for own in root.findall(".//si:unit", NAMES))
    quantities = [own for own in root.findall(".//dcc:quantity", NAMES) if own.find(".//dcc:conformity", NAMES) is not None]
    label = lambda own: own.findtext("si:real/si:label", namespaces=NAMES)
    decisions = {label(own): own.findtext(".//dcc:conformity", namespaces=NAMES) for own in quantities}
    # The limits are 5 µm about an error of 12 µm, and 30 µm about none.
    assert decisions == {"EX0C": "fail", "EY0A": "pass"}


def test_the_schema_accepts_it(certificate):
    """The schema has a licence of its own and is not kept here: `ABBE_DCC_SCHEMA` names the folder with `dcc.xsd` of
    version 3.1.2 and its `SI_Format.xsd`."""
    folder = os.environ.get("ABBE_DCC_SCHEMA")
    if folder is None:
        pytest.skip("ABBE_DCC_SCHEMA names no folder with the schema of PTB")
    xmlschema = pytest.importorskip("xmlschema")
    xmlschema.XMLSchema(str(Path(folder) / "dcc.xsd")).validate(str(certificate[0]))

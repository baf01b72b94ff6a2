"""Contacts as a table: what is written is read, in a truth too."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.errors import FormatError
from shadowpuppet.io.contacts import read_contacts, write_contacts
from shadowpuppet.motion.contact.contact import Contacts


def test_what_is_written_is_read(tmp_path, rng):
    probability = rng.random((7, 2))
    probability[3, 1] = np.nan
    contacts = Contacts(("left_heel", "right_toe"), 0.0123, probability, probability > 0.5)
    times = np.arange(7) / 30
    write_contacts(tmp_path / "contacts.csv", times, contacts)
    found = read_contacts(tmp_path / "contacts.csv")
    assert found is not None
    assert found.names == contacts.names
    np.testing.assert_allclose(found.times, times, atol=1e-6)
    np.testing.assert_array_equal(found.touching, contacts.touching)
    lines = (tmp_path / "contacts.csv").read_text().splitlines()
    assert lines[0] == "time,floor,left_heel_contact,left_heel_probability,right_toe_contact,right_toe_probability"
    assert lines[4].endswith(",0,")  # unknown


def test_other_tables_have_no_contacts_and_wrong_ones_are_named(tmp_path):
    path = tmp_path / "truth.csv"
    path.write_text("time,left_heel_x,left_heel_y,left_heel_z\n0,1,2,3\n")
    assert read_contacts(path) is None
    assert read_contacts(tmp_path / "truth.trc") is None
    path.write_text("time,left_heel_contact\n0,2\n")
    with pytest.raises(FormatError, match="found a contact other than 0 and 1"):
        read_contacts(path)

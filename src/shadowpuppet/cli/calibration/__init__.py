"""Commands about calibrations: `calibrate` makes one, `check` tests one; and one explained or converted, for `info`."""

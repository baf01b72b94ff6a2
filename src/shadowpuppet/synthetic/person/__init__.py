"""Made people: a mannequin of rounded limbs, that shares nothing with the fitted bodies."""

"""How far an estimate may be off: standard deviations of joints and degrees of freedom, and a status for every limb."""

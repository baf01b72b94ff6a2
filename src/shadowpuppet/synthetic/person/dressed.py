"""All lofts of the dressed person."""

from __future__ import annotations

from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.head import head
from shadowpuppet.synthetic.person.limbs import arm, leg
from shadowpuppet.synthetic.person.mannequin import Mannequin
from shadowpuppet.synthetic.person.surface import Surface
from shadowpuppet.synthetic.person.trunk import shoulders, trunk


def dressed(body: Mannequin, clothes: Clothes) -> Surface:
    """The surface of `body` in `clothes`."""
    left = [*arm(body, clothes), *leg(body, clothes)]
    return Surface.of([*trunk(body, clothes), *shoulders(body, clothes), *head(body, clothes), *left, *(loft.mirrored() for loft in left)])

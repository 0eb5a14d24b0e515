"""Contact that comes and goes along a body: rules of which part touches the ground
when, one a file, and who bears the body's weight.

A new file in this folder is found by itself (`rft.core.registry.load_all`);
`rft.contacts.links` is a short example."""

from rft.contacts.base import BEARINGS, CONTACTS, FOLLOWS, ContactRule
from rft.contacts.functions import FunctionContact
from rft.contacts.links import LinkContact
from rft.contacts.touching import Touching
from rft.contacts.wave import WaveContact
from rft.core.registry import load_all
from rft.formulas.support import ContactState, support_margin

load_all(__name__, __path__)

__all__ = [
    "BEARINGS",
    "CONTACTS",
    "FOLLOWS",
    "ContactRule",
    "ContactState",
    "FunctionContact",
    "LinkContact",
    "Touching",
    "WaveContact",
    "support_margin",
]


def __dir__() -> list[str]:
    return __all__

"""The ledger: every numbered statement of the paper, its evidence and its verdict."""

from verification.ledger.evidence import Evidence
from verification.ledger.record import quote
from verification.ledger.rows import Ledger, Row, verify

__all__ = ["Evidence", "Ledger", "Row", "quote", "verify"]

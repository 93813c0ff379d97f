"""Verification: what is claimed against what is found, and every solver against what is known of it."""

from ringbalance.verification.case import CaseDefinition, CaseError
from ringbalance.verification.catalogue import UnknownCaseError, load_case, load_cases
from ringbalance.verification.document import case_document, merge_saved, results_document
from ringbalance.verification.evidence import Evidence, Found, Reference
from ringbalance.verification.result import CaseResult, MutationResult, QuantityResult
from ringbalance.verification.runner import paper_scene, run_case, run_cases, run_mutations
from ringbalance.verification.verdicts import Verdict

__all__ = [
    "CaseDefinition",
    "CaseError",
    "CaseResult",
    "Evidence",
    "Found",
    "MutationResult",
    "QuantityResult",
    "Reference",
    "UnknownCaseError",
    "Verdict",
    "case_document",
    "load_case",
    "load_cases",
    "merge_saved",
    "paper_scene",
    "results_document",
    "run_case",
    "run_cases",
    "run_mutations",
]

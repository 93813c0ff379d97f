"""Sections of the report's page: from evidence to texts, tables and figures.

A new section is a `Section` in the module of its subject, a template of its name, and one line in
`ringbalance.reports.sections`.
"""

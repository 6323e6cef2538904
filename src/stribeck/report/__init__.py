"""Reports as self-contained HTML files; each section has a module and a template."""

from stribeck.report.inspection import write_inspection as write_inspection
from stribeck.report.page import Section as Section
from stribeck.report.page import render_page as render_page
from stribeck.report.reference import Reference as Reference
from stribeck.report.write import write_report as write_report

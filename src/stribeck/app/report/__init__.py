"""Reports as self-contained HTML files; each section has a module and a template."""

from stribeck.app.report.inspection import write_inspection as write_inspection
from stribeck.app.report.page import Section as Section
from stribeck.app.report.page import render_page as render_page
from stribeck.app.report.write import write_report as write_report
from stribeck.core.result.reference import Reference as Reference

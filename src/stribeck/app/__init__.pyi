from .comparison import compare as compare
from .exporters.write import export as export
from .report.curves import write_comparison as write_comparison
from .report.write import write_report as write_report

from postproc.api import Checked as Checked
from postproc.api import Finding as Finding
from postproc.api import Refusal as Refusal
from postproc.api import Report as Report
from postproc.api import check as check
from postproc.api import compensate as compensate
from postproc.api import predict as predict

__version__: str

from postproc.api import Batched as Batched
from postproc.api import Checked as Checked
from postproc.api import Diagnosed as Diagnosed
from postproc.api import Engaged as Engaged
from postproc.api import Finding as Finding
from postproc.api import Identified as Identified
from postproc.api import Learned as Learned
from postproc.api import Mapped as Mapped
from postproc.api import Planned as Planned
from postproc.api import Refusal as Refusal
from postproc.api import Report as Report
from postproc.api import Verified as Verified
from postproc.api import batch as batch
from postproc.api import check as check
from postproc.api import compensate as compensate
from postproc.api import diagnose as diagnose
from postproc.api import engage as engage
from postproc.api import identify as identify
from postproc.api import learn as learn
from postproc.api import map as map
from postproc.api import plan as plan
from postproc.api import predict as predict
from postproc.api import verify as verify

__version__: str

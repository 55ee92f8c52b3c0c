"""`python -m rangeedge`."""

import sys

from .cli import main

sys.exit(main())

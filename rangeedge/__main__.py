"""`python -m rangeedge`."""

import sys

from .app.cli import main

sys.exit(main())

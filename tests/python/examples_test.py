"""The examples run, and leave pictures."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import skipping

skipping.unless_built()
try:
    import matplotlib
except ImportError:
    print("SKIPPED: python3-matplotlib is not there, which the examples draw with")
    sys.exit(77)

EXAMPLES = pathlib.Path(os.environ["LODESTONE_EXAMPLES"])


class Examples(unittest.TestCase):
    def test_each_makes_a_picture(self):
        scripts = sorted(EXAMPLES.glob("*.py"))
        self.assertGreaterEqual(len(scripts), 3)
        for script in scripts:
            with self.subTest(script.name), tempfile.TemporaryDirectory() as folder:
                picture = pathlib.Path(folder) / "picture.png"
                done = subprocess.run([sys.executable, script, "--triangles", "4000", "-o", picture], capture_output=True, text=True,
                                      env={**os.environ, "MPLBACKEND": "Agg", "MPLCONFIGDIR": folder})
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertGreater(picture.stat().st_size, 10000)


if __name__ == "__main__":
    unittest.main()

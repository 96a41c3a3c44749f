#!/usr/bin/env python3
"""Runs a command and says what it took, as JSON: spawn.py RESULT.json LOG COMMAND…

A program of its own, and a small one: Linux counts the memory of whoever starts a process as that process's, until it has become
another program, and what starts the renderers here is large.
"""

import os
import sys
import time

result, log, *command = sys.argv[1:]
output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
actions = [(os.POSIX_SPAWN_DUP2, output, 1), (os.POSIX_SPAWN_DUP2, output, 2)]
start = time.perf_counter()
child = os.posix_spawnp(command[0], command, os.environ, file_actions=actions)
_, status, usage = os.wait4(child, 0)
seconds = time.perf_counter() - start
peak = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
with open(result, "w") as out:
    cpu = usage.ru_utime + usage.ru_stime
    out.write(f'{{"seconds": {seconds}, "cpu_seconds": {cpu}, "peak_bytes": {peak}, "exit": {os.waitstatus_to_exitcode(status)}}}')

"""Watch the force on the tissue from another process: Zenoh and msgpack, nothing of FRAS.

Start `fras up` in one terminal, this in a second one, and `fras run` in a third:

    python examples/watch_force.py [tcp/127.0.0.1:7447]

One sees a bar that grows while the tissue is pulled, twenty times a second of the trial, and the
word `soft` where the pull crosses the limit and the arm gives way. Ctrl-C ends it.
"""

# %% A session in the cell `local`: its namespace stands before each key.
import sys

import msgpack
import zenoh

config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["{(sys.argv[1:] or ["tcp/127.0.0.1:7447"])[0]}"]')
config.insert_json5("namespace", f'"fras/{(sys.argv[2:] or ["local"])[0]}"')

# %% Each verdict is a map; docs/architecture.md says which process publishes what.
with zenoh.open(config) as session, session.declare_subscriber("sa/verdict") as verdicts:
    print("watching", flush=True)
    try:
        for sample in verdicts:
            verdict = msgpack.unpackb(sample.payload.to_bytes())
            if verdict["tick"] % 5 == 0 or not verdict["ok"]:
                bar = "#" * round(40 * verdict["max_force_n"] / verdict["limit_n"])
                print(f"{verdict['max_force_n']:.3f} N {verdict['level']:5} {bar}", flush=True)
    except KeyboardInterrupt:
        print("no longer")

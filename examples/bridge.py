"""The smallest bridge: two arms that are at once where they are told to be, under the keys of CRTK.

No FRAS needed, only Zenoh and MessagePack. In the place of a robot's controller it keeps a list;
a bridge asks the robot what it measures, and refuses what the robot should not do.

    cp compose/crtk.toml mine.toml
    # in [process.arms] of mine.toml:
    #   command = ["{python}", "examples/bridge.py", "{connect}", "{cell}"]
    #   watchdog_s = 0.0
    fras run --compose mine.toml

One sees a trial as with `--compose crtk`. By itself, beside a stack without `arms`:
`python examples/bridge.py tcp/127.0.0.1:7447 local`.
"""

import itertools
import sys
import time
import uuid

import msgpack
import zenoh

# %% Where the arms stand when a trial begins: rad, insertion in m, jaws open by 60 degrees
HOME = [0.29146, 0.0, 0.11090, 0.0, 0.0, -0.29146]
joints = {"psm1": HOME, "psm2": HOME}
jaws_rad = {"psm1": 1.0472, "psm2": 1.0472}

# %% Who this is: the service `arms`, one instance of it
endpoint, cell = sys.argv[1:3]
me = f"arms/{uuid.uuid4().hex[:4]}"
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("namespace", f'"fras/{cell}"')
config.insert_json5("connect/endpoints", f'["{endpoint}"]')
counts: dict[str, int] = {}


def say(session: zenoh.Session, key: str, **fields: object) -> None:
    """Publish a message with its header; `seq` counts each key from 0, without gaps."""
    counts[key] = counts.get(key, -1) + 1
    head = {"stamp_ns": time.time_ns(), "seq": counts[key], "source": me}
    session.put(key, msgpack.packb(head | fields))


# %% Follow: the last setpoint stands until the next
def follow(sample: zenoh.Sample) -> None:
    """Take in a setpoint."""
    told = msgpack.unpackb(sample.payload.to_bytes())
    arm = str(sample.key_expr).partition("/")[0]
    if "jaw_rad" in told:
        jaws_rad[arm] = told["jaw_rad"]
    else:
        joints[arm] = told["joints"]


# %% Say a hundred times a second where the arms are: the jaw first, the joints end the tick
with zenoh.open(config) as session:
    kept = [session.declare_subscriber(key, follow) for key in ("*/servo_jp", "*/jaw/servo_jp")]
    token = session.liveliness().declare_token(f"alive/{me}")
    for turn in itertools.count():
        for arm, at in joints.items():
            if turn % 25 == 0:
                state = {"state": "ENABLED", "is_homed": True, "is_busy": False}
                say(session, f"{arm}/operating_state", **state)
            say(session, f"{arm}/jaw/measured_js", jaw_rad=jaws_rad[arm])
            say(session, f"{arm}/measured_js", joints=at, joint_velocities=[0.0] * 6)
        time.sleep(0.01)

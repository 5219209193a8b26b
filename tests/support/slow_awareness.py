"""Algorithms 1 and 2 of the paper once more, slowly, with loops, straight from its listing.

Nothing is shared with the fast implementation but the inputs. Where the listing needs a reading
(what a tissue point is, what is in a block) it takes the design's. Also the slow side of
`fras bench awareness`.
"""

import math

LX, LY, TOP = 0.1, 0.12, 0.005


def mix(weights, points):
    return [sum(w * p[axis] for w, p in zip(weights, points, strict=True)) for axis in range(3)]


def compute_p_close(nodes, triangles, roi):
    """Algorithm 1, line 3: (triangle, barycentric place, area) of each point closer than 10 mm."""
    points = []
    for triangle in triangles:
        a, b, c = (nodes[k] for k in triangle)
        n = max(1, math.ceil(max(math.dist(a, b), math.dist(b, c), math.dist(c, a)) / 1.25e-3))
        u = [q - p for p, q in zip(a, b, strict=True)]
        v = [q - p for p, q in zip(a, c, strict=True)]
        cross = (
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        )
        area = 0.5 * math.hypot(*cross) / n**2
        for i in range(n):
            for j in range(n - i):
                for third in (1, 2) if i + j < n - 1 else (1,):
                    s, t = (i + third / 3) / n, (j + third / 3) / n
                    place = (1 - s - t, s, t)
                    if math.dist(mix(place, (a, b, c)), roi) < 0.01 - 1e-7:
                        points.append((triangle, place, area))
    return points


def visible(p_close, nodes, roi):
    """Algorithm 2, line 4."""
    seen = total = 0.0
    for triangle, place, area in p_close:
        total += area
        if math.dist(mix(place, [nodes[k] for k in triangle]), roi) > 0.01:
            seen += area
    return seen / total


def block_now(rest, nodes, triangles, x, y):
    """Where the material point at (x, y) of the top face is now."""
    for triangle in triangles:
        corners = [rest[k] for k in triangle]
        if any(abs(p[2] - TOP) > 1e-9 for p in corners):
            continue
        (ax, ay, _), (bx, by, _), (cx, cy, _) = corners
        det = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        s = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / det
        t = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / det
        if s >= -1e-9 and t >= -1e-9 and s + t <= 1 + 1e-9:
            return mix((1 - s - t, s, t), [nodes[k] for k in triangle])
    raise AssertionError(f"no top face at {x}, {y}")


def in_cell(point, i, j, n):
    def inside(value, k, length):
        low, high = (k - 1) * length / n, k * length / n
        return low - 1e-7 <= value < high - 1e-7 or (k == n and value >= low)

    return inside(point[0], i, LX) and inside(point[1], j, LY)


def compute_fluents(scene, nodes, arms, max_height, n):
    """Algorithm 2."""
    rest, triangles, fixed, roi, p_close = scene
    F = set()
    if visible(p_close, nodes, roi) > 0.7:
        F.add("visible_roi")
    for name, (_, jaw) in arms.items():
        if jaw < math.radians(20):
            F.add(f"closed_gripper({name})")
        if name in max_height:
            F.add(f"max_height({name})")
    for i in range(1, n + 1):
        for j in range(1, n + 1):
            b = f"b({i},{j})"
            x, y = (i - 0.5) * LX / n, (j - 0.5) * LY / n
            if in_cell(roi, i, j, n):
                F.add(f"above_roi({b})")
            F.add(f"reachable({'psm1' if y < 0.06 - 1e-9 else 'psm2'},{b})")
            if any(in_cell(p, i, j, n) for p in fixed):
                F.add(f"fixed({b})")
            now = block_now(rest, nodes, triangles, x, y)
            for name, (tip, jaw) in arms.items():
                if math.dist(tip, now) < 0.005:
                    F.add(f"at({name},{b})")
                    if jaw < math.radians(20):
                        F.add(f"in_hand({name},{b})")
    return F


def check_failure(limits, tissue, action):
    """Algorithm 1, lines 8-9, with the design's hard limit, on every tick and action."""
    if not tissue.converged:
        return "invalid"
    force = tissue.max_force_n
    if limits["force_metric"] == "tool":
        force = 0.0
        for x, y, z in tissue.tool_force_n.values():
            force = max(force, math.sqrt(x * x + y * y + z * z))
    if limits["no_limit"]:
        return "ok"
    if force > limits["hard_limit_n"]:
        return "hard"
    pulling = action is not None and action.name == "pull"
    return "soft" if pulling and force > limits["force_limit_n"] else "ok"


def max_heights(history):
    """The arms that may not pull on, from everything that happened: design, section 5.

    Set by a soft crossing, a hard one with tissue in the jaws, or the height reached unexposed;
    the arm's next move or release clears it, in its first tick.
    """
    found = set()
    for arm in ("psm1", "psm2"):
        may_not = False
        for k, (action, level, seen, jaw) in enumerate(history):
            if action is None or action.arm != arm:
                continue
            before = history[k - 1][0] if k > 0 else None
            goes_on = (
                before is not None
                and (before.name, before.arm) == (action.name, action.arm)
                and before.phase not in ("done", "interrupted")
            )
            if action.name in ("move", "release") and not goes_on:
                may_not = False
            if level == "soft":
                may_not = True
            if level == "hard" and action.name != "release" and jaw < math.radians(20):
                may_not = True
            if action.name == "pull" and action.phase == "done" and level != "invalid" and not seen:
                may_not = True
        if may_not:
            found.add(arm)
    return found


def compute_target(name, now, centre, tip):
    """Algorithm 1, compute_target: (x_B, y_B, z_B) for reach, (x_B, y_B, z_i) for move."""
    if name == "reach":
        return now
    return [*centre, tip[2]] if name == "move" else None

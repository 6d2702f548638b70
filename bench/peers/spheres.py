# SPDX-License-Identifier: BSD-3-Clause
"""Spheres that bounce apart from each other on a plane with friction, and where they are by the laws of free fall and of impacts: with
Newton's restitution and Coulomb's friction, which here stops the slip within the first impact, so that the sphere rolls from then on."""
import math

GRAVITY, RADIUS, MASS, INERTIA, RESTITUTION, FRICTION, SPEED = 9.81, 0.1, 1.0, 0.004, 0.5, 0.3, 0.5
END = 0.5                                                 # s: all have bounced, none rests


def places(n):
    """Start of each: x, and the height of its centre."""
    return [(0.3 * i, 0.3 + 0.2 * (i * 7919 % n) / n) for i in range(n)]


def model(n):
    """For Kempe: y is up."""
    text = f"kempe: 1\nname: spheres\ngravity: [0, {-GRAVITY}, 0]\nground: {{points: {{O: [0, 0, 0]}}}}\nbodies:\n"
    text += "".join(f"  s{i}: {{joint: {{name: j{i}, planar: z, at: ground}}, mass: {MASS}, inertia: {{zz: {INERTIA}}}, points: {{C: [0, 0, 0]}}}}\n"
                    for i in range(n))
    text += "contacts:\n" + "".join(f"  c{i}: {{sphere: s{i}.C, radius: {RADIUS}, on: {{plane: ground.O, normal: y}}, restitution: {RESTITUTION}, "
                                    f"friction: {FRICTION}}}\n" for i in range(n))
    q = ", ".join(f"j{i}.1: {x!r}, j{i}.2: {y!r}" for i, (x, y) in enumerate(places(n)))
    return text + f"start: {{q: {{{q}}}, qd: {{" + ", ".join(f"j{i}.1: {SPEED}" for i in range(n)) + f"}}}}\nrun: {{t_end: {END}, outputs: [q]}}\n"


def exact(n):
    """x and height of each at the end."""
    found = []
    for x, y in places(n):
        fall = math.sqrt(2 * (y - RADIUS) / GRAVITY)
        speed = GRAVITY * fall
        turn = MASS * RADIUS**2 / INERTIA
        stops = SPEED / (1 + turn)                        # change of the speed that stops the slip
        assert stops <= FRICTION * (1 + RESTITUTION) * speed and fall < END
        left, speed = END - fall, RESTITUTION * speed
        while left > 2 * speed / GRAVITY:                 # a whole bounce
            left -= 2 * speed / GRAVITY
            speed *= RESTITUTION
        found += [x + SPEED * fall + (SPEED - stops) * (END - fall), RADIUS + speed * left - GRAVITY * left**2 / 2]
    return found

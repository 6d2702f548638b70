/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of the texts of models: a four-bar of hinges A, C, R with the loop q, whose coordinates are exchanged as it
 * turns. */
#ifndef KEMPE_TESTS_FOUR_BAR_TEXT_H
#define KEMPE_TESTS_FOUR_BAR_TEXT_H

#define FOUR_BAR_TEXT                                                                                                  \
    "ground: {points: {B: [1, 0, 0]}}\nbodies:\n"                                                                      \
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.01}, "           \
    "points: {P: [0.3, 0, 0]}}\n"                                                                                      \
    "  coupler: {joint: {name: C, revolute: z, at: crank.P}, mass: 1, com: [0.45, 0, 0], inertia: {zz: 0.1}, "         \
    "points: {Q: [0.9, 0, 0]}}\n"                                                                                      \
    "  rocker: {joint: {name: R, revolute: z, at: ground.B}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.05}, "         \
    "points: {Q: [0.6, 0, 0]}}\n"                                                                                      \
    "loops: {q: {ball: [coupler.Q, rocker.Q]}}\n"

/* A four-bar of hinges A, B, D with the loop C and the parameter crank, its length; ground.D is of the model. */
#define CRANKED_FOUR_BAR_TEXT                                                                                          \
    "bodies:\n"                                                                                                        \
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, "                              \
    "points: {B: [crank, 0, 0]}}\n"                                                                                    \
    "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, com: [0.4, 0, 0], inertia: {zz: 0.05}, "             \
    "points: {C: [0.8, 0, 0]}}\n"                                                                                      \
    "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.04}, "         \
    "points: {C: [0.7, 0, 0]}}\n"                                                                                      \
    "loops: {C: {ball: [rod.C, rocker.C]}}\n"                                                                          \
    "start: {q: {A: 80 deg, B: -62 deg, D: 106 deg}, hold: [A]}\n"

#endif

/* SPDX-License-Identifier: BSD-3-Clause */
/* Part of the text of a model: a four-bar of hinges A, C, R with the loop q, whose coordinates are exchanged as it
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

#endif

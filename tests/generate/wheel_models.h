/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheels on rails whose equations are compiled and compared at states near their starts. */
#ifndef KEMPE_TESTS_WHEEL_MODELS_H
#define KEMPE_TESTS_WHEEL_MODELS_H

static const char *const wheel_models[] = {"examples/tram/tram.yaml",
                                           "examples/bogie_track/bogie_track.yaml",
                                           "examples/wheelset/wheelset.yaml",
                                           "examples/rolling_wheel/rolling_wheel.yaml",
                                           "examples/curving/curving.yaml",
                                           "examples/manchester/manchester.yaml",
                                           "examples/manchester/manchester_wheelset.yaml",
                                           "examples/bogie_track/bogie_on_rails.yaml",
                                           "examples/restrained_wheelset/wheelset_on_rails.yaml",
                                           "examples/conicity/conicity.yaml",
                                           "tests/models/wheels.yaml",
                                           "tests/models/one_wheel.yaml"};
enum { WHEEL_MODELS = sizeof wheel_models / sizeof *wheel_models };

#endif

/* SPDX-License-Identifier: BSD-3-Clause */
/* A functional mock-up unit on the library: the mechanism is read from the resources of the unit, and a stepper of the
 * library takes the place of the generated simulator. The layers of the FMI are those of units of sources. */
#pragma once

#include "exchange/fmu/unit_parts.h"
#include "exchange/simulator/kempe_fmu.h"
#include <kempe/output_handles.h>
#include <kempe/settings.h>
#include <kempe/stepper.h>

/** The mechanism of one instance, and its motion. */
typedef struct kmp_library_unit {
    kempe_fmu_model table;
    kempe_equations equations; /* names and sizes alone: no function of it is called */
    kmp_code_source source;
    kmp_arena arena;
    char token[KMP_UNIT_TOKEN];
    kempe_context *context;
    const char *path;        /* of the model */
    kempe_setting *settings; /* of the export, with room for all parameters after them */
    int setting_count;
    kempe_model *model;            /* as exported */
    kempe_model *other;            /* with the values of the importer; NULL: those of the export */
    kempe_system *system, *set_up; /* of each; set_up NULL: none */
    double *values;                /* parameters of `other` */
    kempe_outputs *outputs;        /* of the system of the motion */
    kempe_stepper *stepper;        /* the motion; NULL: it has not started */
    double *given;                 /* three an input: as the stepper has them */
    kempe_simulator_work before;   /* work until the stepper was restored */
} kmp_library_unit;

/** The unit whose equations a simulator has. */
kmp_library_unit *kmp_library_unit_of(const kempe_simulator *s);

/** Puts the mechanism with these parameters into unit->set_up; that of the export where they are equal. */
kempe_status kmp_library_unit_set_up(kmp_library_unit *unit, const double *parameters);

/** Frees the motion. */
void kmp_library_unit_stop(kmp_library_unit *unit);

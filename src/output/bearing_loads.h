/* SPDX-License-Identifier: BSD-3-Clause */
/* The loads of the bearings of a model in a run: the largest radial and axial forces, and equivalent loads, as text,
 * JSON and table. */
#pragma once

#include "output/reactions.h"

/** Of one bearing. NaN: not known, or it carries nothing of that kind. */
typedef struct kmp_bearing_peak {
    kmp_reaction_peak radial, axial; /* axial: x[0] along the axis of the joint */
    double equivalent;               /* the mean of the radial force^p over time, its p-th root */
} kmp_bearing_peak;

typedef struct kmp_bearing_loads {
    const kempe_system *system;
    kmp_bearing_peak *of; /* two of each pair of the model */
    bool whole;           /* they are of the motion from `from` to `until`; otherwise there was no step */
    double from, until;
} kmp_bearing_loads;

/** Room for the bearings of the model, all unknown. false: no memory. */
bool kmp_bearing_loads_init(kmp_bearing_loads *loads, const kempe_system *system, kmp_arena *arena);

/** The radial force of a bearing (0, 1) and the force along the axis, by KMP_BEARING_VALUES of a pair. */
double kmp_bearing_radial(const double *values, int bearing);

/** Takes the values of all pairs at an instant, as kmp_all_loads_bearings gives them. */
void kmp_bearing_loads_meet(kmp_bearing_loads *loads, double t, const double *values);

/** A table, the array `bearings` of an open object, and the table `bearings`; nothing in text and JSON of a model
 * without bearings. `reactions`: of the same run, by which loads are unique. */
void kmp_bearing_loads_show(kmp_text *text, const kmp_bearing_loads *loads, const kmp_reactions *reactions);
void kmp_bearing_loads_json(kmp_json *json, const kmp_bearing_loads *loads, const kmp_reactions *reactions);
void kmp_bearing_loads_columns(kempe_table *table);
void kmp_bearing_loads_tabulate(kempe_table *table, const kmp_bearing_loads *loads, const kmp_reactions *reactions);

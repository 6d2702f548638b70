/* SPDX-License-Identifier: BSD-3-Clause */
/* What a table of contacts is (kempe/contact_table.h): which values, and the states and patches at each. */
#ifndef KMP_STUDIES_WHEEL_CONTACT_CONTACT_SWEEP_H
#define KMP_STUDIES_WHEEL_CONTACT_CONTACT_SWEEP_H

#include "model/rail/wheels.h"
#include "model/tables/ranges.h"
#include "model/variant.h"
#include "studies/equilibrium/operating.h"
#include <kempe/contact.h>
#include <kempe/contact_table.h>

/** A range of `over`: a parameter of the variant, or a coordinate that is held. */
typedef struct kmp_contact_lead {
    int parameter, hold; /* one of them is -1 */
} kmp_contact_lead;

struct kempe_contact_table {
    kmp_arena arena; /* of all arrays */
    const kempe_system *given;
    kmp_variant *variant; /* what varies, and the outputs of wheels */
    kempe_system *system; /* of the variant */
    kempe_status status;
    char *reason;   /* NULL: none */
    char *warnings; /* of the computation, one a line */
    kmp_ranges over;
    kmp_contact_lead *lead;
    int parameter_count;
    kmp_steady *hold; /* what leads or moves on */
    int hold_count;
    bool has_law;
    kempe_creep_law law;
    int asked, count;
    double *value; /* of the first range */
    double *q, *qd;
    double residual; /* the largest, relative */
    int iterations;
    int wheel_count;
    int *first; /* wheel_count + 1: patches of a value, before each wheel's */
    kempe_contact_patch *patch;
    double cpu_s;
};

/** Reads what is asked into a table that has its system: leads, holds, law, values. */
kempe_status kmp_contact_ask(kempe_contact_table *table, const kempe_contact_options *ask);

/** The place of a coordinate among those held; -1: it is not. */
int kmp_contact_hold_of(const kempe_contact_table *table, int coordinate);

/** A patch from the KMP_CONTACT_SHOWN values that the wheel's output has of a zone; its radius from the profile. */
void kmp_contact_patch(const kempe_contact_table *table, int wheel, const double *shown, kempe_contact_patch *patch);

#endif

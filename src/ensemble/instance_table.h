/* SPDX-License-Identifier: BSD-3-Clause */
/* The table "instances" (kempe/ensemble.h) summed up and described: of one run, or gathered from a result folder. */
#pragma once

#include "base/context.h"
#include "ensemble/instance_causes.h"
#include <kempe/ensemble.h>

/** Counts, sums and worst values of all rows. A row is ok if its result is complete. */
typedef struct kmp_instance_sums {
    long count, ok, stopped, failed, distrusted; /* distrusted: of the complete ones */
    long steps, rejected, refused, rhs, exchanges;
    double h, hdot, drift;
    long rates_changed, first_changed; /* starts whose velocities were adjusted; the number of the first, from 0 on */
    long gaps_changed, first_gap;      /* starts that change ropes or teeth, likewise */
    long unstable, first_unstable;     /* starts in a balance that is not stable, likewise */
    long leaving, first_leaving;       /* starts at an unstable equilibrium, likewise */
    long deflected, first_deflected;   /* whose flexible bodies deflect too far, likewise */
    long shared, first_shared;         /* whose motions depend on how redundant contacts share loads, likewise */
    long repeated, not_converged;      /* with a verdict of the convergence check */
    long worst;                        /* number of the one that differs most among the ones that have not converged */
    double difference;                 /* of that one; infinite: its other run did not reach its end */
    bool doubted;                      /* set by the caller: the whole is not trustworthy for another reason */
} kmp_instance_sums;

/** Sums of a table whose first row is instance number `first`, from 0 on. */
kmp_instance_sums kmp_instances_sum(const kempe_table *instances, long first);

/** Counts a row by the word of its outcome. */
void kmp_instances_count(kmp_instance_sums *sums, const char *word);

/** Adds the counts of another part of the instances. */
void kmp_instances_add(kmp_instance_sums *sums, const kmp_instance_sums *part);

/** The outcome of all. */
kempe_outcome kmp_instances_outcome(const kmp_instance_sums *sums);

/** The word of the column `start` where initial velocities were adjusted. */
#define KMP_RATES_ADJUSTED "velocities adjusted"
/** The word where closing the loops changes ropes or teeth that count from the start as it is written. */
#define KMP_GAPS_CHANGED "lengths changed"
/** The word where deformations start in a balance that is not stable. */
#define KMP_BALANCE_UNSTABLE "unstable balance"

/** The word where the start is at an unstable equilibrium. */
#define KMP_EQUILIBRIUM_UNSTABLE "unstable equilibrium"

/** The word of the column `verdict` where a flexible body has had a deflection that its shapes are not right
 * for.
 */
#define KMP_DEFLECTED_FAR "deflected too far"
/** The word where friction makes the motion depend on how redundant contacts share their loads. */
#define KMP_LOADS_SHARED "loads not unique"

/** Says how many instances of a finished run cannot be trusted, and where the reasons are. */
void kmp_instances_put_distrusted(kmp_text *text, const kmp_instance_sums *sums);

/** Appends the sentences of warnings, one a line; logs them. */
void kmp_instances_put_warnings(kmp_text *text, const kmp_instance_sums *sums);
kempe_status kmp_instances_warn(kempe_context *context, const kmp_instance_sums *sums);

/** Appends the first line, "MODEL: OUTCOME, how many", and the causes of instances that did not reach their end. */
void kmp_instances_put_answer(kmp_text *text, const char *model, kempe_outcome outcome, const kmp_instance_sums *sums,
                              const kmp_instance_causes *causes);

/** Appends lines about the accuracy of all; `label`: before the first one. */
void kmp_instances_put_accuracy(kmp_text *text, const char *label, const kmp_instance_sums *sums);

/** Appends lines about the accuracy of quantities, whose table begins with instance number `first`. */
void kmp_instances_put_measured(kmp_text *text, const kempe_table *instances, long first);

/** Appends the description of a whole table. `statistics`: printed at the end, NULL for none. `doubted`: as in the
 * sums. */
void kmp_instances_put(kmp_text *text, const char *model, const kempe_table *instances,
                       const kempe_statistics *statistics, bool doubted);

/** Appends the text of statistics after an empty line; nothing for NULL. */
void kmp_instances_put_statistics(kmp_text *text, const kempe_statistics *statistics);

/* SPDX-License-Identifier: BSD-3-Clause */
/* Components of the loads of joints and loops that the equations of rigid bodies do not determine: some set of loads
 * only of the constraints balances itself and has them. Rows that no coordinate moves are part of these sets, such as
 * those out of the plane of a flat linkage. */
#pragma once

#include "base/text.h"
#include "constraints/evaluation/evaluator.h"

enum { KMP_LOAD_SIZE = 6 }; /* a force, then a moment about the point of the second body, in ground axes */

typedef struct kmp_shared_loads {
    bool (*of_body)[KMP_LOAD_SIZE];    /* body_count: of the joint that carries a body */
    bool (*of_closure)[KMP_LOAD_SIZE]; /* closure_count */
    bool *of_rows;                     /* closure_count: a multiplier of a row that coordinates move is shared */
    bool loaded;  /* masses that move or gravity load such components: they are not zero in all joints */
    bool matters; /* they are loaded, or not zero in the loads of kmp_shared_loads_between: users must know of them */
} kmp_shared_loads;

/** Finds them at (t, q), a closed configuration in the user's own charts. KEMPE_E_MEMORY. */
kempe_status kmp_find_shared_loads(kmp_evaluator *eval, double t, const double *q, kmp_arena *arena,
                                   kmp_shared_loads *found);

/** "A: z, mx, my; C: mx": loads of joints and loops by name; their number. */
int kmp_put_shared_loads(kmp_text *text, const kempe_model *model, const kmp_shared_loads *found);

/** The names of components: x, y, z, mx, my, mz. */
extern const char *const kmp_load_words[KMP_LOAD_SIZE];

/** Reads "least-norm"; NULL: the loads belong to one solution. KEMPE_E_ARGUMENT: another word. */
kempe_status kmp_load_share_read(kempe_context *context, const char *word, bool *least_norm);

/** Shared loads become the loads of least norm: the sum of the squares of all forces, and of all moments over the
 * characteristic length, is least. `loads` has KMP_LOAD_SIZE of each closure, then of the joint that carries each body
 * of `joint`. KEMPE_E_FAILED: loads are shared with a closure whose loads on bodies are not known. */
kempe_status kmp_least_norm_loads(kmp_evaluator *eval, double t, const double *q, int joints, const int *joint,
                                  double *loads);

/** Finds the loads that are shared at both of two configurations, in the arena; `loads` as above, at the second one. */
kempe_status kmp_shared_loads_between(kmp_evaluator *eval, const double t[2], const double *const q[2], int joints,
                                      const int *joint, const double *loads, kmp_arena *arena, kmp_shared_loads *found);

/** Warns of these, and doubts friction that depends on them. *text ("" without any, in the arena): their names, as
 * kmp_put_shared_loads has them. Loads that are not printed cause no warning. */
kempe_status kmp_report_shared_loads(const kempe_system *system, const kmp_shared_loads *found, bool least_norm,
                                     kmp_arena *arena, const char **text);

/** Doubts only friction that depends on them, at a closed state q, for a study whose other loads are its own concern.
 * True: there is some. False without a message where memory is exhausted, and while the context is quiet. */
bool kmp_doubt_shared_friction(const kempe_system *system, double t, const double *q);

/** Warns of components of loads that outputs of the model show, or their sensors, and doubts friction, likewise;
 * `shown` has the values of the outputs. `least_norm`: loads of outputs have the least norm, and only sensors have
 * the loads of one solution. */
kempe_status kmp_warn_of_shared_loads(kmp_evaluator *eval, const double t[2], const double *const q[2],
                                      const double *shown, bool least_norm);

/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * The state in which the loops are closed, and the diagnosis of a mechanism: mobility, redundancy, limits of motion,
 * assembly modes.
 */
#ifndef KEMPE_CHECK_H
#define KEMPE_CHECK_H

#include <kempe/table.h>

KEMPE_BEGIN

typedef struct kempe_assembly kempe_assembly;

/** Closes the loops from the model's guess: held coordinates are fixed, rates are made consistent. KEMPE_E_FAILED: the
 * context's message has the loop that stays open and its gap. `*assembly` is then still given, with the best
 * configuration found. KEMPE_UNTRUSTED: a condition would end a run at this start; the result names it. */
KEMPE_API kempe_status kempe_assembly_new(const kempe_system *system, kempe_assembly **assembly);
KEMPE_API void kempe_assembly_free(kempe_assembly *assembly);

/** q and qd of the assembled state, n values, owned by the assembly. */
KEMPE_API const double *kempe_assembly_q(const kempe_assembly *assembly);
KEMPE_API const double *kempe_assembly_qd(const kempe_assembly *assembly);
KEMPE_API kempe_status kempe_assembly_print(const kempe_assembly *assembly, kempe_format format, char **text);

/** Writes a self-contained HTML page: the mechanism as assembled, the printed result. KEMPE_E_IO: the path
 * cannot be written. */
KEMPE_API kempe_status kempe_assembly_write_report(const kempe_assembly *assembly, const char *path);

typedef struct kempe_check kempe_check;

/** Mobility, redundant rows (everywhere, or only here) and closures that may be left out, the independent coordinates
 * of the formulations and their reason, limits of motion. KEMPE_E_FAILED: the model does not assemble; `*check` is then
 * still given, with the obstacle. */
KEMPE_API kempe_status kempe_check_new(const kempe_system *system, kempe_check **check);
KEMPE_API void kempe_check_free(kempe_check *check);

/** KEMPE_TEXT: the verdict and the main results, some 15 lines; KEMPE_FULL_TEXT: all of them. */
KEMPE_API kempe_status kempe_check_print(const kempe_check *check, kempe_format format, char **text);

/** Tables; cells are unknown where the mechanism does not assemble, or was not examined. "mobility", one row: bodies,
 * coordinates, closures, rows, rank, dof, driven, generic_dof (elsewhere), cond_Jv, max_B, margin (to a change point).
 * "coordinates": coordinate, unit, role (independent, dependent), instead_of and max_B (if it were independent), low,
 * high, turns, low_dead_centre, high_dead_centre (1: it turns back there). "closures": closure, kind, rows, redundant
 * (how many of them), may_lose (rows without a change of mobility), gap in m, turn in rad.
 * The turn is the angle between axes that a closure aligns, or of rows without length. KEMPE_E_ARGUMENT: another
 * name. */
KEMPE_API kempe_status kempe_check_table(const kempe_check *check, const char *name, kempe_table **table);

typedef struct kempe_branches kempe_branches;

/** Assembly modes: the configurations in which the loops close with the held coordinates fixed. Finds others by
 * assembling from many random starts with the held coordinates fixed. If fewer
 * coordinates are held than there are degrees of freedom, further independent ones are fixed. Sampling may miss some
 * modes. `seed` chooses the starts; the same seed gives the same result. */
KEMPE_API kempe_status kempe_branches_new(const kempe_system *system, int seed, kempe_branches **branches);
KEMPE_API void kempe_branches_free(kempe_branches *branches);

/** The number of modes, and q of the k-th (n values, owned by the branches). The first mode is the model's. */
KEMPE_API int kempe_branches_count(const kempe_branches *branches);
KEMPE_API const double *kempe_branches_q(const kempe_branches *branches, int k);
KEMPE_API kempe_status kempe_branches_print(const kempe_branches *branches, kempe_format format, char **text);

KEMPE_END
#endif

/* SPDX-License-Identifier: BSD-3-Clause */
/* A judgement of runs that a wing (base/wings.h) adds to those of the core. */
#pragma once

#include "base/json.h"
#include "dynamics/system.h"
#include "integrators/run/recording.h"
#include <kempe/kempe.h>

typedef struct kmp_run_judge {
    /** Before the run, whose messages remain: *before is what the judgement needs, in the arena; NULL: the run is not
     * judged. */
    kempe_status (*prepare)(const kempe_system *system, const kempe_run_options *run, kmp_arena *arena, void **before);
    /** Judges a recorded run; *verdict is in the arena. */
    kempe_status (*judge)(const kempe_system *system, kmp_recording *recording, const void *before, kmp_arena *arena,
                          void **verdict);
    /** Puts a paragraph, and a member of an open object. */
    void (*show)(kmp_text *text, const kempe_model *model, const void *verdict);
    void (*json)(kmp_json *json, const kempe_model *model, const void *verdict);
} kmp_run_judge;

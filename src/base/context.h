/* SPDX-License-Identifier: BSD-3-Clause */
/* The context: messages, log, interrupt. */
#pragma once

#include "base/shown_units.h"
#include "base/text.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** The folder of cached results, NULL: none is used. */
const char *kmp_context_cache(const kempe_context *context);

/** Support of the root of a robot in another format. */
typedef enum kmp_base { KMP_BASE_OF_FORMAT, KMP_BASE_FIXED, KMP_BASE_FREE } kmp_base;
kmp_base kmp_context_base(const kempe_context *context);

/** True if limits of joints in foreign models are stops. Sets that and returns what it was. */
bool kmp_context_has_limits(const kempe_context *context);
bool kmp_context_use_limits(kempe_context *context, bool limits);

/** True if parts of foreign models that act only at times and are not used are errors. */
bool kmp_context_is_strict(const kempe_context *context);

/** True if a part of a foreign model with this name may be left out. Sets those names, separated by commas or blanks
 * (NULL: none), which must outlive the use, and returns the names before. */
bool kmp_context_leaves_out(const kempe_context *context, const char *name);
const char *kmp_context_use_left_out(kempe_context *context, const char *names);

/** Notes a file that a model or a mesh is read from (kempe_context_is_source). KEMPE_E_MEMORY. */
kempe_status kmp_context_note_source(kempe_context *context, const char *path);

/** A context for a thread of a computation: an interrupt of the context above ends it, too. It logs nothing, reports no
 * progress and uses no cache; it is quiet if that is. NULL: no memory. The context above must outlive it. */
kempe_context *kmp_context_new_below(kempe_context *above);

/** The text that a caller has given in place of a file of this name, also to a context above; NULL: none. */
const char *kmp_context_text(const kempe_context *context, const char *name);

/** True: the context, or one above, reads files in one folder and nowhere else. */
bool kmp_context_is_confined(const kempe_context *context);

/** The folder that the context, or one above, reads files in and nowhere else, where the file of this path is not in
 * it; NULL: it may be read, or is not there. */
const char *kmp_context_beyond(const kempe_context *context, const char *path);

/** Forgets the old message. Each public function that can fail begins with it. */
void kmp_context_clear(kempe_context *context);

/** Begins a computation that calls kmp_interrupted: discards the message, the warnings, and the interrupt that ended an
 * earlier one. While quiet the computation is a part of another one, whose warnings stay. */
void kmp_context_begin(kempe_context *context);

/** Appends one sentence to the message and returns `status`, so that a failure reads
 *  `return kmp_fail(ctx, KEMPE_E_FAILED, "loop '%s': ...", ...)`. */
kempe_status kmp_fail(kempe_context *context, kempe_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/** kmp_fail with a sentence that was put together, which is freed. KEMPE_E_MEMORY if it has failed. */
kempe_status kmp_fail_text(kempe_context *context, kempe_status status, kmp_text *sentence);

/** Returns the status of `call` from the enclosing function, unless that is KEMPE_OK. */
#define KMP_TRY(call)                                                                                                  \
    do {                                                                                                               \
        kempe_status kmp_tried = (call);                                                                               \
        if (kmp_tried != KEMPE_OK)                                                                                     \
            return kmp_tried;                                                                                          \
    } while (0)

/** Declares a new object, all zero; KEMPE_E_MEMORY: the function returns it. */
#define KMP_MAKE(context, type, name)                                                                                  \
    type *name = KMP_NEW(type, 1);                                                                                     \
    if (!name)                                                                                                         \
    return kmp_fail_memory(context)

/** The end of a function that makes an object: gives it to the caller where it is `whole`, or else frees it; the
 * second: unless the status is an error. */
#define KMP_GIVE_IF(whole, status, out, made, release)                                                                 \
    ((whole) ? (*(out) = (made), (status)) : ((release)(made), (status)))
#define KMP_GIVE_OR_FREE(status, out, made, release)                                                                   \
    KMP_GIVE_IF(kmp_is_complete(status), (status), (out), (made), (release))

/* Required arguments of public functions. KMP_WANTED: KEMPE_E_ARGUMENT with a sentence if a context can be reached
 * (NULL: it cannot). KMP_WANTED_BOTH: an object with a context, and another argument. KMP_GIVEN, in a getter: the value
 * returned for a missing object. KMP_GETTER, KMP_GETTER_AT: a whole getter of an object, of its entry k out of `count`.
 */
#define KMP_MISSING "%s is NULL or missing"
#define KMP_WANTED(context, thing, name)                                                                               \
    do {                                                                                                               \
        if (!(thing))                                                                                                  \
            return kmp_fail_missing((context), (name));                                                                \
    } while (0)
#define KMP_WANTED_BOTH(object, thing)                                                                                 \
    KMP_WANTED(NULL, object, #object);                                                                                 \
    KMP_WANTED((object)->context, thing, #thing)
#define KMP_GIVEN(thing, otherwise)                                                                                    \
    do {                                                                                                               \
        if (!(thing))                                                                                                  \
            return otherwise;                                                                                          \
    } while (0)
#define KMP_GETTER(signature, object, value, otherwise)                                                                \
    signature                                                                                                          \
    {                                                                                                                  \
        return (object) ? (value) : (otherwise);                                                                       \
    }
#define KMP_GETTER_AT(signature, object, k, count, value, otherwise)                                                   \
    KMP_GETTER(signature, (object) && (k) >= 0 && (k) < (count), value, otherwise)

/** Replaces `given`, a pointer to options of a caller (NULL: the defaults), by a copy of the library's size. The member
 * `size` is the size of the caller's struct, 0: the size in version 0.1. KEMPE_E_ARGUMENT: it has members that are set
 * and unknown here. A member that is added to a struct comes last, and `first` below becomes its offset. */
#define KMP_OPTIONS(context, type, given)                                                                              \
    type kmp_own_##given;                                                                                              \
    KMP_TRY(kmp_options_copy((context), &kmp_own_##given, sizeof(type), sizeof(type), (given),                         \
                             (given) ? (given)->size : 0));                                                            \
    (given) = &kmp_own_##given
enum { KMP_MOST_OPTIONS = 4096 };
kempe_status kmp_options_copy(kempe_context *context, void *own, size_t known, size_t first, const void *given,
                              size_t size);

kempe_status kmp_fail_missing(kempe_context *context, const char *name);

/** KEMPE_E_MEMORY with its sentence. */
static inline kempe_status kmp_fail_memory(kempe_context *context)
{
    (void)kmp_fail(context, KEMPE_E_MEMORY, "out of memory");
    return KEMPE_E_MEMORY;
}

/** KEMPE_OK if what needs memory was made, otherwise that error. */
static inline kempe_status kmp_made(kempe_context *context, bool made)
{
    return made ? KEMPE_OK : kmp_fail_memory(context);
}

/** Errors beyond this number are counted and not kept: a reader begins with the first ones. */
enum { KMP_MOST_COMPLAINTS = 500 };

/** Appends `file:line:column: sentence`, lines and columns from 1; `file: sentence` for line 0, a model built in code.
 * Returns KEMPE_E_INPUT, or KEMPE_E_MEMORY when there is no memory for the sentence. */
kempe_status kmp_complain(kempe_context *context, const char *file, int line, int column, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

/** Errors since the message was cleared, including errors that were not kept. */
int kmp_context_complaints(const kempe_context *context);

/** A unit of SI as results show it, by the caller's choice (kempe_context_set_angle_unit, kempe_context_set_units). The
 * name lasts as long as the context. */
kmp_shown kmp_shown_as(const kempe_context *context, const char *unit);

/** The system of units of results that are made now; NULL: SI. */
const char *kmp_context_system(const kempe_context *context);

/** Chooses what results are shown in; returns the choice before. */
kmp_shown_in kmp_context_show_in(kempe_context *context, kmp_shown_in in);

/** Tells the caller's function, if one is set and its interval has passed, that `done` of `total` is done.
 * KMP_PROGRESS_RUN: the time of a run, which may be a part of a study that counts as KMP_PROGRESS_STUDY. */
enum { KMP_PROGRESS_RUN, KMP_PROGRESS_STUDY, KMP_PROGRESS_KINDS };
void kmp_progress(kempe_context *context, int kind, double done, double total, const char *unit);

/** While quiet nothing but progress is logged. The former value. */
bool kmp_context_quiet(kempe_context *context, bool quiet);
bool kmp_context_is_quiet(const kempe_context *context);

/** Warnings since the computation began, one a line, each once and no more than KMP_MOST_WARNINGS. One that has a time
 * is there once, at its first time, whatever its other numbers; "" when there are none. To be freed with kmp_free;
 * NULL: no memory. */
enum { KMP_MOST_WARNINGS = 100 };
char *kmp_context_warnings(const kempe_context *context);

/** Warnings of kmp_doubt since the computation began, one a line, each once. The text belongs to the context. */
const char *kmp_context_doubts(const kempe_context *context);

void kmp_log(kempe_context *context, kempe_level level, const char *format, ...) __attribute__((format(printf, 3, 4)));

/** Logs a warning that says why the result of the current computation cannot be trusted: a check of it failed, a bound
 * on work ended before the asked accuracy, a part of the model is not in the equations. The computation then ends with
 * the status "not trustworthy". A warning that leaves the result right is kmp_log. The reader of a model keeps
 * its doubts as notes (model/read/read_include.c), which each computation with the model takes up. */
void kmp_doubt(kempe_context *context, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** Begins the words of a doubt of a run whose rows come from a checkpoint. */
#define KMP_BEFORE_CHECKPOINT "before the checkpoint: "

/** Keeps what is logged and doubted from now on apart, until it is known whether it belongs to the result: an attempt
 * may be discarded. Progress is not kept. No other attempt may be under way. */
void kmp_context_hold(kempe_context *context);

/** Ends this: logs what was kept, or, unless `keep`, forgets it. */
void kmp_context_release(kempe_context *context, bool keep);

/** The end of each public study: the status that the caller gets, KEMPE_UNTRUSTED in place of KEMPE_OK where kmp_doubt
 * was called since the computation began. While quiet the computation is a part of another one, which judges itself. */
kempe_status kmp_context_verdict(const kempe_context *context, kempe_status status);

/** True if the whole result is there, also where it cannot be trusted. Functions inside the library return only
 * KEMPE_OK for that; the status of a result, and the status of a public study, may be either. */
static inline bool kmp_is_complete(kempe_status status)
{
    return status == KEMPE_OK || status == KEMPE_UNTRUSTED;
}

/** Takes up a warning of an earlier computation, the reading of the model, without logging it again; `doubts`: as
 * kmp_doubt. */
void kmp_context_recall(kempe_context *context, const char *line, bool doubts);

/** True if the current computation is to end; it stays so until the next one begins. */
bool kmp_interrupted(kempe_context *context);

/** For a call that does not begin a computation, because others of the context may run in further threads: true if an
 * interrupt has ended a computation, whose successor has not begun; and true if an interrupt has come since, where
 * `before` is what the first function has returned at the begin of the call. */
bool kmp_interrupt_taken(const kempe_context *context);
bool kmp_interrupted_since(kempe_context *context, bool before);

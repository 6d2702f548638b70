/* SPDX-License-Identifier: BSD-3-Clause */
/* The context hides how messages are kept and how an interrupt is signalled. An interrupt ends the computation that
 * sees it, all parts of it; the next computation begins without it. */
#include "base/context.h"
#include "base/memory.h"
#include "platform/platform.h"
#include <ctype.h>
#include <errno.h>
#include <kempe/cache.h>
#include <kempe/settings.h>
#include <limits.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* A count that is reported. It starts again where it falls, or where the total or unit is another one. */
typedef struct count {
    kempe_progress last;
    double began, from, due; /* on the wall; `done` at the beginning */
    bool reported;           /* some of it was reported: its end will be */
} count;

struct kempe_context {
    kempe_context *above; /* NULL: none */
    kmp_text message;
    kempe_log_fn *log;
    void *user;
    bool quiet, strict, limits;
    kmp_shown_in shown_in;
    kmp_shown_units *shown; /* NULL while the system is SI */
    kmp_base base;
    char *own_left_out;   /* names that the caller gave */
    const char *left_out; /* the ones in use; NULL: none */
    int complaints;       /* since the message was cleared */
    kmp_text warnings;    /* of the current computation, one per line */
    int warning_count;
    bool doubted;    /* a warning of the current computation says that its result cannot be trusted */
    kmp_text doubts; /* such warnings, one per line */
    bool holding;
    kmp_text held; /* lines of an attempt, one per line after its level; DOUBTED: a doubt */
    atomic_int interrupt;
    kempe_progress_fn *progress; /* NULL: none */
    void *progress_user;
    double progress_interval;
    count counts[KMP_PROGRESS_KINDS];
    char *cache; /* folder of cached results; NULL: none */
    struct source {
        uint64_t device, file;
    } * sources; /* files that models and meshes were read from */
    int source_count;
    char *folder; /* files are read only within it; NULL: everywhere */
    struct given {
        char *name, *text;
    } * given; /* texts in place of files */
    int given_count;
};

/* States of the interrupt: an idle context, a request to end the current or next computation, a computation that is
 * ending. */
enum { NONE, ASKED, TAKEN };

const char *kempe_version(void)
{
    return KEMPE_VERSION;
}

const char *kempe_status_text(kempe_status status)
{
    switch (status) {
#define KMP_STATUS(name, value, words, exit_code, advice)                                                              \
    case KEMPE_##name:                                                                                                 \
        return words;
#include "base/statuses.def"
#undef KMP_STATUS
    }
    return kempe_status_text(KEMPE_E_BUG);
}

#define KMP_STATUS(name, value, words, exit_code, advice)                                                              \
    _Static_assert((int)KEMPE_##name == (value), "kempe.h and statuses.def give one value");
#include "base/statuses.def"
#undef KMP_STATUS

kempe_context *kempe_context_new(void)
{
    kempe_context *context = KMP_NEW(kempe_context, 1);
    if (context)
        atomic_init(&context->interrupt, NONE);
    return context;
}

kempe_context *kmp_context_new_below(kempe_context *above)
{
    kempe_context *context = kempe_context_new();
    if (context) {
        context->above = above;
        context->shown_in = above->shown_in;
        context->shown = above->shown ? kmp_shown_units_new() : NULL;
        context->quiet = above->quiet;
    }
    if (context && !context->shown != !above->shown) {
        kempe_context_free(context);
        return NULL;
    }
    return context;
}

void kempe_context_free(kempe_context *context)
{
    if (!context)
        return;
    kmp_text_free(&context->message);
    kmp_text_free(&context->warnings);
    kmp_text_free(&context->doubts);
    kmp_text_free(&context->held);
    kmp_shown_units_free(context->shown);
    kmp_free(context->cache);
    kmp_free(context->own_left_out);
    kmp_free(context->sources);
    kmp_free(context->folder);
    for (int k = 0; k < context->given_count; k++) {
        kmp_free(context->given[k].name);
        kmp_free(context->given[k].text);
    }
    kmp_free(context->given);
    kmp_free(context);
}

static bool has_source(const kempe_context *context, const kmp_path_state *file)
{
    for (int k = 0; k < context->source_count; k++)
        if (context->sources[k].device == file->device && context->sources[k].file == file->number)
            return true;
    return false;
}

kempe_status kmp_context_note_source(kempe_context *context, const char *path)
{
    kmp_path_state file;
    if (!kmp_path_look(path, &file) || file.kind != KMP_PATH_FILE || has_source(context, &file))
        return KEMPE_OK;
    struct source *sources = kmp_realloc(context->sources, (size_t)context->source_count + 1, sizeof *sources);
    if (!sources)
        return kmp_fail_memory(context);
    sources[context->source_count++] = (struct source){file.device, file.number};
    context->sources = sources;
    return KEMPE_OK;
}

int kempe_context_is_source(const kempe_context *context, const char *path)
{
    kmp_path_state file;
    return context && path && kmp_path_look(path, &file) && has_source(context, &file);
}

/* The text of a name, -1: there is none. */
static int find_given(const kempe_context *context, const char *name)
{
    int k = context->given_count - 1;
    while (k >= 0 && strcmp(context->given[k].name, name) != 0)
        k--;
    return k;
}

const char *kmp_context_text(const kempe_context *context, const char *name)
{
    for (const kempe_context *c = context; c; c = c->above) {
        const int k = find_given(c, name);
        if (k >= 0)
            return c->given[k].text;
    }
    return NULL;
}

/* A new name with its text, both of which the context then owns. False: no memory. */
static bool add_given(kempe_context *context, char *name, char *text)
{
    struct given *room = kmp_realloc(context->given, (size_t)context->given_count + 1, sizeof *room);
    if (room)
        context->given = room;
    if (!room || !name || !text)
        return false;
    context->given[context->given_count++] = (struct given){name, text};
    return true;
}

kempe_status kempe_context_set_text(kempe_context *context, const char *name, const char *text)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, name, "name");
    const int k = find_given(context, name);
    if (k >= 0) {
        kmp_free(context->given[k].name);
        kmp_free(context->given[k].text);
        context->given[k] = context->given[--context->given_count];
    }
    if (!text)
        return KEMPE_OK;
    char *own_name = kmp_strdup(name), *own_text = kmp_strdup(text);
    if (add_given(context, own_name, own_text))
        return KEMPE_OK;
    kmp_free(own_name);
    kmp_free(own_text);
    return kmp_fail_memory(context);
}

kempe_status kempe_context_set_folder(kempe_context *context, const char *folder)
{
    KMP_WANTED(NULL, context, "context");
    char real[KMP_PATH_MOST];
    kmp_context_clear(context);
    if (folder && !kmp_path_real(folder, real))
        return kmp_fail(context, KEMPE_E_IO, "cannot find the folder '%s': %s", folder, strerror(errno));
    char *copy = folder ? kmp_strdup(real) : NULL;
    if (folder && !copy)
        return kmp_fail_memory(context);
    kmp_free(context->folder);
    context->folder = copy;
    return KEMPE_OK;
}

/* The only folder that may be read; NULL: all may. */
static const char *folder_of(const kempe_context *context)
{
    const char *folder = NULL;
    for (const kempe_context *c = context; c && !folder; c = c->above)
        folder = c->folder;
    return folder;
}

bool kmp_context_is_confined(const kempe_context *context)
{
    return folder_of(context);
}

const char *kmp_context_beyond(const kempe_context *context, const char *path)
{
    char real[KMP_PATH_MOST];
    const char *folder = folder_of(context);
    if (!folder || !kmp_path_real(path, real))
        return NULL;
    const size_t length = strlen(folder);
    const bool at_root = length > 0 && kmp_is_separator(folder[length - 1]);
    const bool within = strncmp(real, folder, length) == 0 && (at_root || kmp_is_separator(real[length]));
    return within ? NULL : folder;
}

kempe_status kempe_context_set_cache(kempe_context *context, const char *folder)
{
    KMP_WANTED(NULL, context, "context");
    char *copy = folder ? kmp_strdup(folder) : NULL;
    if (folder && !copy)
        return kmp_fail_memory(context);
    kmp_free(context->cache);
    context->cache = copy;
    return KEMPE_OK;
}

const char *kmp_context_cache(const kempe_context *context)
{
    return context->cache;
}

char *kempe_cache_folder(void)
{
    const char *given = kmp_environment("KEMPE_CACHE");
    if (given && *given)
        return strcmp(given, "off") == 0 ? NULL : kmp_strdup(given);
    char folder[KMP_PATH_MOST];
    kmp_path_cache(folder);
    return *folder ? kmp_strdup(folder) : NULL;
}

void kempe_context_set_log(kempe_context *context, kempe_log_fn *log, void *user)
{
    KMP_GIVEN(context, );
    context->log = log;
    context->user = user;
}

/* -- units of results --------------------------------------------------------------------------------- */

kempe_status kempe_context_set_angle_unit(kempe_context *context, const char *unit)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, unit, "unit");
    kmp_context_clear(context);
    bool degrees = strcmp(unit, "deg") == 0;
    if (!degrees && strcmp(unit, "rad") != 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "unknown unit of angles '%s'; there are rad and deg", unit);
    context->shown_in.degrees = degrees;
    return KEMPE_OK;
}

kempe_status kempe_context_set_units(kempe_context *context, const char *system)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, system, "system");
    kmp_context_clear(context);
    const kmp_unit_system chosen = kmp_unit_system_find(system);
    if (chosen == KMP_UNIT_SYSTEMS)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "unknown system of units '%s'; there are si, mm and us", system);
    if (chosen != KMP_UNITS_SI && !context->shown)
        KMP_TRY(kmp_made(context, (context->shown = kmp_shown_units_new()) != NULL));
    context->shown_in.system = chosen;
    return KEMPE_OK;
}

/* -- files in other formats --------------------------------------------------------------------------- */

kempe_status kempe_context_set_base(kempe_context *context, const char *base)
{
    KMP_WANTED(NULL, context, "context");
    kmp_context_clear(context);
    bool fixed = base && strcmp(base, "fixed") == 0;
    if (base && !fixed && strcmp(base, "free") != 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "unknown base '%s' of robots; there are fixed and free", base);
    context->base = !base ? KMP_BASE_OF_FORMAT : fixed ? KMP_BASE_FIXED : KMP_BASE_FREE;
    return KEMPE_OK;
}

kempe_status kempe_context_set_strict(kempe_context *context, int strict)
{
    KMP_WANTED(NULL, context, "context");
    kmp_context_clear(context);
    context->strict = strict != 0;
    return KEMPE_OK;
}

kempe_status kempe_context_set_joint_limits(kempe_context *context, int limits)
{
    KMP_WANTED(NULL, context, "context");
    kmp_context_clear(context);
    context->limits = limits != 0;
    return KEMPE_OK;
}

bool kmp_context_use_limits(kempe_context *context, bool limits)
{
    bool before = context->limits;
    context->limits = limits;
    return before;
}

bool kmp_context_has_limits(const kempe_context *context)
{
    return context->limits;
}

kempe_status kempe_context_set_left_out(kempe_context *context, const char *names)
{
    KMP_WANTED(NULL, context, "context");
    kmp_context_clear(context);
    char *copy = names ? kmp_strdup(names) : NULL;
    if (names && !copy)
        return kmp_fail_memory(context);
    kmp_free(context->own_left_out);
    context->left_out = context->own_left_out = copy;
    return KEMPE_OK;
}

const char *kmp_context_use_left_out(kempe_context *context, const char *names)
{
    const char *before = context->left_out;
    context->left_out = names;
    return before;
}

bool kmp_context_leaves_out(const kempe_context *context, const char *name)
{
    static const char between[] = ", ";
    size_t length = strlen(name);
    for (const char *at = context->left_out ? context->left_out : ""; *at; at += strspn(at, between)) {
        size_t own = strcspn(at, between);
        if (own > 0 && own == length && strncmp(at, name, own) == 0)
            return true;
        at += own;
    }
    return false;
}

kmp_base kmp_context_base(const kempe_context *context)
{
    return context->base;
}

bool kmp_context_is_strict(const kempe_context *context)
{
    return context->strict;
}

/* -- units in texts ----------------------------------------------------------------------------------- */

kmp_shown kmp_shown_as(const kempe_context *context, const char *unit)
{
    return kmp_shown_units_get(context->shown, context->shown_in, unit);
}

const char *kmp_context_system(const kempe_context *context)
{
    const kmp_unit_system system = context->shown_in.system;
    return system == KMP_UNITS_SI ? NULL : kmp_unit_system_name(system);
}

kmp_shown_in kmp_context_show_in(kempe_context *context, kmp_shown_in in)
{
    const kmp_shown_in before = context->shown_in;
    context->shown_in = in;
    return before;
}

const char *kempe_context_message(const kempe_context *context)
{
    KMP_GIVEN(context, "");
    if (context->message.failed)
        return "out of memory";
    return context->message.s ? context->message.s : "";
}

void kempe_context_interrupt(kempe_context *context)
{
    if (context)
        atomic_store_explicit(&context->interrupt, ASKED, memory_order_relaxed);
}

void kempe_context_clear_interrupt(kempe_context *context)
{
    int asked = ASKED;
    if (context)
        (void)atomic_compare_exchange_strong_explicit(&context->interrupt, &asked, NONE, memory_order_relaxed,
                                                      memory_order_relaxed);
}

/* A request made while the computation is ending has no further effect. */
bool kmp_interrupted(kempe_context *context)
{
    int state = ASKED;
    return atomic_compare_exchange_strong_explicit(&context->interrupt, &state, TAKEN, memory_order_relaxed,
                                                   memory_order_relaxed) ||
           state == TAKEN || (context->above && kmp_interrupted(context->above));
}

bool kmp_interrupt_taken(const kempe_context *context)
{
    return atomic_load_explicit(&context->interrupt, memory_order_relaxed) == TAKEN;
}

bool kmp_interrupted_since(kempe_context *context, bool before)
{
    int state = atomic_load_explicit(&context->interrupt, memory_order_relaxed);
    return (state == ASKED && atomic_compare_exchange_strong_explicit(&context->interrupt, &state, TAKEN,
                                                                      memory_order_relaxed, memory_order_relaxed)) ||
           (state == TAKEN && !before);
}

void kmp_context_begin(kempe_context *context)
{
    int taken = TAKEN;
    (void)atomic_compare_exchange_strong_explicit(&context->interrupt, &taken, NONE, memory_order_relaxed,
                                                  memory_order_relaxed);
    if (!context->quiet) {
        kmp_text_free(&context->warnings);
        kmp_text_free(&context->doubts);
        context->warning_count = 0;
        context->doubted = false;
    }
    memset(context->counts, 0, sizeof context->counts);
    kmp_context_clear(context);
}

void kmp_context_clear(kempe_context *context)
{
    kmp_text_free(&context->message);
    context->complaints = 0;
}

/* Makes a sentence one line that a terminal shows as it is, whatever the text in it. */
static void flatten(kmp_text *text, size_t from)
{
    if (!text->failed && text->s)
        kmp_text_clean(text->s + from, ' ');
}

static size_t begin_sentence(kmp_text *message)
{
    if (message->length > 0)
        kmp_text_put(message, "\n");
    return message->length;
}

kempe_status kmp_fail(kempe_context *context, kempe_status status, const char *format, ...)
{
    size_t from = begin_sentence(&context->message);
    KMP_TEXT_ARGUMENTS(&context->message, format);
    flatten(&context->message, from);
    return status;
}

kempe_status kmp_fail_text(kempe_context *context, kempe_status status, kmp_text *sentence)
{
    bool whole = !sentence->failed;
    status = whole ? kmp_fail(context, status, "%s", sentence->s ? sentence->s : "") : kmp_fail_memory(context);
    kmp_text_free(sentence);
    return status;
}

kempe_status kmp_options_copy(kempe_context *context, void *own, size_t known, size_t first, const void *given,
                              size_t size)
{
    const unsigned char *bytes = given;
    size = size ? size : first;
    memset(own, 0, known);
    if (!given)
        return KEMPE_OK;
    kmp_context_clear(context);
    if (size < sizeof size || size > KMP_MOST_OPTIONS)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "size = %zu of the options does not belong to any version of this struct", size);
    for (size_t k = known; k < size; k++)
        if (bytes[k])
            return kmp_fail(context, KEMPE_E_ARGUMENT,
                            "the options have members that version %s of the library does not know: their size is %zu, "
                            "the known one %zu",
                            KEMPE_VERSION, size, known);
    memcpy(own, given, size < known ? size : known);
    return KEMPE_OK;
}

kempe_status kmp_fail_missing(kempe_context *context, const char *name)
{
    if (!context)
        return KEMPE_E_ARGUMENT;
    kmp_context_clear(context);
    return kmp_fail(context, KEMPE_E_ARGUMENT, KMP_MISSING, name);
}

kempe_status kmp_complain(kempe_context *context, const char *file, int line, int column, const char *format, ...)
{
    if (context->complaints < INT_MAX)
        context->complaints++;
    if (context->complaints > KMP_MOST_COMPLAINTS)
        return context->message.failed ? KEMPE_E_MEMORY : KEMPE_E_INPUT;
    size_t from = begin_sentence(&context->message);
    if (line > 0)
        kmp_text_printf(&context->message, "%s:%d:%d: ", file, line, column);
    else
        kmp_text_printf(&context->message, "%s: ", file);
    KMP_TEXT_ARGUMENTS(&context->message, format);
    flatten(&context->message, from);
    return context->message.failed ? KEMPE_E_MEMORY : KEMPE_E_INPUT;
}

int kmp_context_complaints(const kempe_context *context)
{
    return context->complaints;
}

bool kmp_context_quiet(kempe_context *context, bool quiet)
{
    bool before = context->quiet;
    context->quiet = quiet;
    return before;
}

bool kmp_context_is_quiet(const kempe_context *context)
{
    return context->quiet;
}

char *kmp_context_warnings(const kempe_context *context)
{
    return kmp_strdup(context->warnings.s ? context->warnings.s : "");
}

const char *kmp_context_doubts(const kempe_context *context)
{
    return context->doubts.s ? context->doubts.s : "";
}

static bool ends(const char *line)
{
    return *line == '\0' || *line == '\n';
}

static const char *skip_checkpoint(const char *line)
{
    const size_t length = sizeof KMP_BEFORE_CHECKPOINT - 1;
    return strncmp(line, KMP_BEFORE_CHECKPOINT, length) == 0 ? line + length : line;
}

/* Skips a number, unless it is a part of a word. */
static const char *skip_number(const char *line, char before)
{
    const char *at = line + (*line == '-');
    if (*at < '0' || *at > '9' || isalnum((unsigned char)before) || before == '_' || before == '.')
        return line;
    return at + strspn(at, "0123456789.e+-");
}

/* True if two lines are equal, or say the same of two times: all but their numbers is equal, also what they quote. */
static bool say_the_same(const char *a, const char *b)
{
    bool equal = true, timed = false, quoted = false;
    char before = ' ';
    for (a = skip_checkpoint(a), b = skip_checkpoint(b); !ends(a) && !ends(b);) {
        const char *a_end = quoted ? a : skip_number(a, before), *b_end = quoted ? b : skip_number(b, before);
        if (a_end > a && b_end > b) {
            equal = equal && a_end - a == b_end - b && memcmp(a, b, (size_t)(a_end - a)) == 0;
            before = '0';
            a = a_end;
            b = b_end;
            continue;
        }
        if (*a != *b)
            return false;
        timed = timed || (!quoted && strncmp(a, " t = ", 5) == 0);
        quoted = quoted != (*a == '\'');
        before = *a;
        a++;
        b++;
    }
    return ends(a) && ends(b) && (equal || timed);
}

static bool has_line(const kmp_text *lines, const char *line)
{
    for (const char *at = lines->s ? lines->s : ""; *at; at += strcspn(at, "\n") + 1)
        if (say_the_same(at, line))
            return true;
    return false;
}

/* True if the warning is new: a start that is assembled twice gives one warning. */
static bool keep_warning(kempe_context *context, const char *line)
{
    if (has_line(&context->warnings, line))
        return false;
    if (context->warning_count >= KMP_MOST_WARNINGS)
        return false;
    context->warning_count++;
    kmp_text_printf(&context->warnings, "%s\n",
                    context->warning_count < KMP_MOST_WARNINGS ? line : "further warnings are omitted");
    return true;
}

/* -- progress ---------------------------------------------------------------------------------------- */

void kempe_context_set_progress(kempe_context *context, double interval, kempe_progress_fn *progress, void *user)
{
    if (!context)
        return;
    context->progress = progress;
    context->progress_user = user;
    context->progress_interval = interval;
    memset(context->counts, 0, sizeof context->counts);
}

void kmp_progress(kempe_context *context, int kind, double done, double total, const char *unit)
{
    count *c = &context->counts[kind];
    if (!context->progress)
        return;
    double now = kmp_wall_now();
    const kempe_progress *last = &c->last;
    if (!last->unit || strcmp(last->unit, unit) != 0 || last->total != total || done < last->done) /* another count */
        *c = (count){.began = now, .from = done, .due = now + context->progress_interval};
    double elapsed = now - c->began, ahead = done - c->from;
    c->last = (kempe_progress){done, total, unit, elapsed, ahead > 0 ? (total - done) * elapsed / ahead : -1};
    if (now < c->due && !(c->reported && done >= total))
        return;
    c->due = now + context->progress_interval;
    c->reported = true;
    context->progress(context->progress_user, &c->last);
}

/* -- log --------------------------------------------------------------------------------------------- */

enum { DOUBTED = 'd' }; /* in place of the level of a line */

/* A line for the caller. A warning is kept, each once. */
static void put_line(kempe_context *context, char level, const char *line)
{
    const bool doubted = level == DOUBTED;
    const kempe_level own = doubted ? KEMPE_LOG_WARNING : (kempe_level)(level - '0');
    if (doubted && context->warning_count < KMP_MOST_WARNINGS && !has_line(&context->doubts, line))
        kmp_text_printf(&context->doubts, "%s\n", line);
    context->doubted = context->doubted || doubted;
    if ((own != KEMPE_LOG_WARNING || keep_warning(context, line)) && context->log)
        context->log(context->user, own, line);
}

/* The same, unless an attempt keeps it. */
static void take_line(kempe_context *context, char level, kmp_text *line)
{
    if (context->holding && level - '0' != KEMPE_LOG_PROGRESS)
        kmp_text_printf(&context->held, "%c%s\n", level, line->failed ? "" : line->s);
    else if (!line->failed)
        put_line(context, level, line->s);
    else
        context->doubted = context->doubted || level == DOUBTED;
    kmp_text_free(line);
}

void kmp_context_hold(kempe_context *context)
{
    context->holding = true;
}

void kmp_context_release(kempe_context *context, bool keep)
{
    context->holding = false;
    char *at = keep && !context->held.failed ? context->held.s : NULL;
    context->doubted = context->doubted || (keep && context->held.failed); /* its lines are lost */
    while (at && *at) {
        char *end = at + strcspn(at, "\n");
        *end = '\0';
        put_line(context, *at, at + 1);
        at = end + 1;
    }
    kmp_text_free(&context->held);
}

void kmp_log(kempe_context *context, kempe_level level, const char *format, ...)
{
    bool kept = level == KEMPE_LOG_WARNING;
    if ((!context->log && !kept) || (context->quiet && level != KEMPE_LOG_PROGRESS))
        return;
    kmp_text line = {0};
    KMP_TEXT_ARGUMENTS(&line, format);
    flatten(&line, 0);
    take_line(context, (char)('0' + level), &line);
}

void kmp_doubt(kempe_context *context, const char *format, ...)
{
    if (context->quiet)
        return;
    kmp_text line = {0};
    KMP_TEXT_ARGUMENTS(&line, format);
    flatten(&line, 0);
    take_line(context, DOUBTED, &line);
}

void kmp_context_recall(kempe_context *context, const char *line, bool doubts)
{
    context->doubted = context->doubted || doubts;
    (void)keep_warning(context, line);
}

kempe_status kmp_context_verdict(const kempe_context *context, kempe_status status)
{
    return status == KEMPE_OK && context->doubted && !context->quiet ? KEMPE_UNTRUSTED : status;
}

/* SPDX-License-Identifier: BSD-3-Clause */
/* Values of implicit blocks: Newton's method (newton.h) on a block's program, and averages. */
#include "symbolic/solving.h"
#include "base/memory.h"
#include "linalg/newton.h"
#include "symbolic/implicit.h"
#include "symbolic/interpreter.h"
#include <math.h>
#include <string.h>

/* KEPT: solutions, of the lists of arguments that are evaluated in turn: all lanes, component by component. */
enum { KEPT = 16, BLOCK_STAGES = 4 };

struct kmp_solving {
    const kmp_program_block *block;
    const kmp_block_runner *runner;
    bool shares;                 /* the next three belong to another one */
    void *code;                  /* the runner's */
    const kmp_places_room *kind; /* of averages, or of the merits of candidates; NULL: neither */
    void *room;
    double *p;                  /* the current arguments */
    double *solved, *component; /* KEPT: arguments, and their solutions */
    long runs[BLOCK_STAGES];    /* of stages, one by one */
    int known, next,
        last; /* of these: their number, the one that the next solution replaces, the last that was taken */
};

/* The interpreter as a runner. */
static void *prepare(const kmp_program *program)
{
    return kmp_interpreter_new(program);
}

static void release(void *code)
{
    kmp_interpreter_free(code);
}

static void set(void *code, kmp_input_kind kind, const double *values)
{
    kmp_interpreter_set(code, kind, values);
}

static void run(void *code, int stage)
{
    kmp_interpreter_run(code, stage);
}

static const double *outputs(const void *code, int stage)
{
    return kmp_interpreter_outputs(code, stage);
}

static const kmp_block_runner interpreted = {prepare, release, set, run, outputs, false};

static const double *run_stage(kmp_solving *s, int stage)
{
    s->runs[stage]++;
    s->runner->run(s->code, stage);
    return s->runner->outputs(s->code, stage);
}

/* Without a program's code or room. */
static kmp_solving *make_solving(const kmp_program_block *block, const kmp_block_runner *runner)
{
    kmp_solving *s = KMP_NEW(kmp_solving, 1);
    if (!s)
        return NULL;
    s->block = block;
    s->runner = runner ? runner : &interpreted;
    s->p = KMP_NEW(double, (1 + KEPT) * block->arguments + KEPT * block->unknowns);
    if (!s->p) {
        kmp_free(s);
        return NULL;
    }
    s->solved = s->p + block->arguments;
    s->component = s->solved + KEPT * block->arguments;
    return s;
}

kmp_solving *kmp_solving_new(const kmp_program_block *block, const kmp_block_runner *runner)
{
    kmp_solving *s = make_solving(block, runner);
    if (!s)
        return NULL;
    const bool averages = block->averages, wide = averages || block->candidates > 0;
    const kmp_places_wing *places = wide ? kmp_places_of_build() : NULL;
    if (places) {
        s->kind = averages ? &places->averages : &places->merits;
        s->room = s->kind->make(block, s->runner->native);
    }
    if (!averages)
        s->code = s->runner->prepare(block->program);
    if ((averages || s->code) && (!wide || s->room))
        return s;
    kmp_solving_free(s);
    return NULL;
}

kmp_solving *kmp_solving_beside(const kmp_solving *other)
{
    kmp_solving *s = make_solving(other->block, other->runner);
    if (!s)
        return NULL;
    s->shares = true;
    kmp_solving_move(s, other);
    return s;
}

void kmp_solving_move(kmp_solving *s, const kmp_solving *other)
{
    s->code = other->code;
    s->kind = other->kind;
    s->room = other->room;
}

void kmp_solving_free(kmp_solving *s)
{
    if (!s)
        return;
    if (!s->shares) {
        if (s->code)
            s->runner->release(s->code);
        if (s->room)
            s->kind->release(s->room);
    }
    kmp_free(s->p);
    kmp_free(s);
}

kmp_counts kmp_solving_count(const kmp_solving *s)
{
    kmp_counts c = {0};
    if (s->room && !s->shares)
        c = s->kind->count(s->room);
    for (int stage = 0; stage < s->block->program->stages; stage++) {
        const kmp_counts once = kmp_program_count(s->block->program, stage, stage);
        kmp_counts_add(&c, &once, s->runs[stage]);
    }
    return c;
}

bool kmp_solving_is_done(const kmp_solving *s)
{
    return s->known > 0;
}

double *kmp_solving_arguments(kmp_solving *s)
{
    return s->p;
}

/* -- Newton's method ----------------------------------------------------------------------------------- */

/* Parts that the guesses and the merit share with the residuals were computed elsewhere. */
static const double *equations(void *self, const double *y, double *merit)
{
    kmp_solving *s = self;
    s->runner->set(s->code, KMP_IN_Q, y);
    if (s->block->candidates > 0) {
        if (s->block->unknowns > 1)
            (void)run_stage(s, 1);
        *merit = *run_stage(s, 2);
    }
    return run_stage(s, s->block->program->stages - 1);
}

static void guess(void *self, double *y)
{
    kmp_solving *s = self;
    const bool among = s->block->candidates > 0;
    if (among)
        s->runner->set(s->code, KMP_IN_Q, y);
    const double *all = run_stage(s, 1);
    for (int i = among; i < s->block->unknowns; i++)
        y[i] = all[i];
}

static const double *merits(void *self)
{
    kmp_solving *s = self;
    return s->kind->run(s->room, s->p);
}

static bool solve(kmp_solving *s, double *y)
{
    kmp_newton newton = {.unknowns = s->block->unknowns,
                         .candidates = s->block->candidates,
                         .candidate = s->block->candidate,
                         .self = s,
                         .equations = equations,
                         .guess = guess,
                         .merits = merits};
    s->runner->set(s->code, KMP_IN_PARAMETER, s->p);
    (void)run_stage(s, 0);
    bool solved = kmp_newton_solve(&newton);
    memcpy(y, newton.y, (size_t)s->block->unknowns * sizeof *y);
    return solved;
}

/* True if the current arguments are the arguments of a kept solution, to the bit; mostly the first of them decides. */
static inline bool is_of(const kmp_solving *s, size_t k)
{
    size_t count = (size_t)s->block->arguments;
    const double *kept = s->solved + k * count;
    return count == 0 || (memcmp(s->p, kept, sizeof *kept) == 0 && memcmp(s->p, kept, count * sizeof *kept) == 0);
}

double kmp_solving_component(const kmp_solving *s, int component)
{
    return s->component[(size_t)s->last * (size_t)s->block->unknowns + (size_t)component];
}

double kmp_solving_value(kmp_solving *s, int component)
{
    size_t arguments = (size_t)s->block->arguments, unknowns = (size_t)s->block->unknowns;
    size_t k = (size_t)s->last, known = (size_t)s->known;
    if (known > 0 && is_of(s, k)) /* another component of the last one */
        return kmp_solving_component(s, component);
    for (k = 0; k < known && !is_of(s, k);)
        k++;
    if (k == known) {
        k = (size_t)s->next;
        /* Solves for the current arguments; NaN where there is no solution. */
        double *y = s->component + k * unknowns;
        int n = s->block->unknowns;
        if (s->block->averages) {
            memcpy(y, s->kind->run(s->room, s->p), (size_t)n * sizeof(double));
        } else if (!solve(s, y)) {
            for (int i = 0; i < n; i++)
                y[i] = NAN;
        }
        memcpy(s->solved + k * arguments, s->p, arguments * sizeof *s->p);
        s->known = s->known < KEPT ? s->known + 1 : KEPT;
        s->next = (s->next + 1) % KEPT;
    }
    s->last = (int)k;
    return kmp_solving_component(s, component);
}

/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code for the arithmetic between functions, in the program's order: the operations and the roundings of the
 * tape, so that the bits are its bits. If the machine has no such code, or the system does not let it run, the tape
 * runs. */
#include "backend/native.h"
#include "backend/prepared.h"
#include "base/memory.h"
#include "symbolic/row_code.h"
#include <math.h>

/* -- rows ------------------------------------------------------------------------------------------------ */

/* Pieces of a program between two functions, with the values of places alone left out, as machine code whose bases are
 * its arguments. A value that leaves its register goes to its row, which no other value has before its last use. */

/* KIND: from which on the kinds of these forms of programs are, beyond those of kmp_x86_form. LEAST: the number of
 * operations for which a call pays. */
enum { KIND = 1024, LEAST_PIECE = 2 };

typedef struct rows {
    kmp_row_code code; /* first */
    kmp_arena arena;   /* of the pieces */
    void *pages;
    size_t size;
} rows;

static void release_rows(kmp_program_form *form)
{
    rows *r = (rows *)form;
    kmp_pages_free(r->pages, r->size);
    kmp_arena_free(&r->arena);
    kmp_free(r);
}

/* A program and its pieces. */
typedef struct writing {
    const kmp_program *p;
    const kmp_row_address *address;
    kmp_arena arena; /* of all arrays */
    int leaves, count;
    int *piece_of; /* by instruction: + 1; 0: in none */
    bool *kept;    /* by instruction: read outside its piece */
    kmp_row_piece *piece;
    kmp_straight *operations; /* of one piece */
    kmp_x86_address *place;   /* by value */
    uint32_t *offset;         /* of each piece in the code */
} writing;

static bool is_by_slot(const writing *w, int instruction)
{
    return w->address[w->leaves + instruction].base == KMP_ROW_BY_SLOT;
}

/* True for the larger one of a value and a constant that is neither zero nor NaN. The processor's maximum of the
 * constant and the value then has the same bits. */
static bool is_floor(const kmp_program *p, const kmp_instruction *in)
{
    return in->op == KMP_OP_MAX && (int)(in->b >> 1) < p->constant_count && fabs(p->constant[in->b >> 1]) > 0;
}

/* True for arithmetic whose operands have no sign, but for the second one of a sum. Other signs are only in programs
 * from files, and are left to the interpreter. */
static bool is_straight(const kmp_program *p, const kmp_instruction *in)
{
    return (kmp_code_is_straight(in) || is_floor(p, in)) && !(in->a & 1) &&
           (in->op == KMP_OP_ADD || in->op == KMP_OP_SQRT || !(in->b & 1));
}

static void close_piece(writing *w, int end, int operations)
{
    kmp_row_piece *last = &w->piece[w->count];
    last->end = end;
    if (operations < LEAST_PIECE) {
        for (int i = last->first; i < end; i++)
            w->piece_of[i] = 0;
        return;
    }
    w->count++;
}

static int end_of(const kmp_program *p)
{
    return p->code[KMP_ROW_LAST + 1];
}

static void keep(writing *w, uint32_t operand, int piece)
{
    const int i = (int)(operand >> 1) - w->leaves;
    if (i >= 0 && w->piece_of[i] != piece)
        w->kept[i] = true;
}

static bool write(writing *w, kmp_x86 *x86)
{
    const uint32_t values = (uint32_t)(w->leaves + end_of(w->p));
    kmp_registers registers;
    if (!kmp_registers_init(&registers, &w->arena, values, values, (uint32_t)end_of(w->p), true))
        return false;
    registers.address = w->place;
    for (int k = 0; k < w->count; k++) {
        w->offset[k] = (uint32_t)x86->size;
        uint32_t count = 0;
        for (int i = w->piece[k].first; i < w->piece[k].end; i++) {
            const kmp_instruction *in = &w->p->instruction[i];
            if (!is_by_slot(w, i))
                continue;
            const bool one = in->op == KMP_OP_SQRT, floor = in->op == KMP_OP_MAX;
            w->operations[count++] = (kmp_straight){.op = (uint16_t)(floor ? KMP_X86_MAX : kmp_code_op(in)),
                                                    .d = (uint32_t)(w->leaves + i),
                                                    .x = one ? 0 : (floor ? in->b : in->a) >> 1,
                                                    .y = (one || floor ? in->a : in->b) >> 1,
                                                    .kept = w->kept[i]};
        }
        kmp_registers_write(&registers, x86, count, w->operations);
    }
    return !x86->failed;
}

static bool find_pieces(writing *w)
{
    const int code = end_of(w->p), values = w->leaves + code;
    if (!KMP_ARENA_MAKE(&w->arena, KMP_ROOM(int, code, &w->piece_of), KMP_ROOM(bool, code, &w->kept),
                        KMP_ROOM(kmp_row_piece, code, &w->piece), KMP_ROOM(kmp_straight, code, &w->operations),
                        KMP_ROOM(kmp_x86_address, values, &w->place), KMP_ROOM(uint32_t, code, &w->offset)))
        return false;
    /* Addresses of rows; those too far from their base have none. */
    const int32_t most = INT32_MAX / (int32_t)sizeof(double);
    for (int k = 0; k < values; k++) {
        if (w->address[k].at > most)
            return false;
        w->place[k] = (kmp_x86_address){(int)w->address[k].base, (int32_t)sizeof(double) * w->address[k].at};
    }
    /* Cuts the stages into pieces at functions. Instructions that depend on places alone belong to no piece, and end
     * none. */
    for (int stage = KMP_ROW_FIRST; stage <= KMP_ROW_LAST; stage++) {
        int operations = 0;
        for (int i = w->p->code[stage]; i <= w->p->code[stage + 1]; i++) {
            const bool at_end = i == w->p->code[stage + 1];
            if (!at_end && !is_by_slot(w, i))
                continue;
            if (!at_end && is_straight(w->p, &w->p->instruction[i])) {
                if (operations++ == 0)
                    w->piece[w->count].first = i;
                w->piece_of[i] = w->count + 1;
            } else if (operations > 0) {
                close_piece(w, i, operations);
                operations = 0;
            }
        }
    }
    /* Values that other pieces read, or outputs. */
    const kmp_program *p = w->p;
    for (int i = p->code[KMP_ROW_FIRST]; i < end_of(p); i++)
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            keep(w, kmp_instruction_operand(&p->instruction[i], k), w->piece_of[i]);
    for (int k = p->outputs[KMP_ROW_FIRST]; k < p->outputs[KMP_ROW_LAST + 1]; k++)
        keep(w, p->output[k], 0);
    return true;
}

static bool load_rows(rows *r, const writing *w, const kmp_x86 *x86)
{
    r->code.count = w->count;
    r->code.piece = kmp_arena_copy(&r->arena, w->piece, w->count, sizeof *w->piece);
    r->pages = r->code.piece ? kmp_pages_new(x86->code, x86->size) : NULL;
    r->size = x86->size;
    for (int k = 0; r->pages && k < w->count; k++)
        kmp_code_at(r->pages, w->offset[k], &r->code.piece[k].run);
    return r->pages;
}

static rows *write_rows(const kmp_program *program, size_t width, const kmp_row_address *address)
{
    rows *r = KMP_NEW(rows, 1);
    if (!r)
        return NULL;
    kmp_x86 x86 = {.form = kmp_x86_runs(KMP_X86_EIGHT) ? KMP_X86_EIGHT : KMP_X86_FOUR};
    writing w = {.p = program, .address = address, .leaves = program->constant_count + program->input_count};
    r->code =
        (kmp_row_code){.form = {.kind = KIND + (int)width, .release = release_rows}, .lanes = kmp_x86_lanes(x86.form)};
    bool made = find_pieces(&w) && write(&w, &x86) && load_rows(r, &w, &x86);
    kmp_x86_free(&x86);
    kmp_arena_free(&w.arena);
    if (made)
        return r;
    release_rows(&r->code.form);
    return NULL;
}

/* A kmp_row_writer; NULL also on machines without such code. */
static const kmp_row_code *row_code_of(const kmp_program *program, size_t width, const kmp_row_address *address)
{
    kmp_program_form *found = kmp_program_find_form(program, KIND + (int)width);
    if (found || !kmp_x86_runs(KMP_X86_FOUR))
        return (const kmp_row_code *)found;
    rows *made = write_rows(program, width, address);
    return made ? (const kmp_row_code *)kmp_program_add_form(program, &made->code.form) : NULL;
}

typedef struct native {
    kmp_frame frame;             /* first, as in the tape */
    kmp_routine *const *segment; /* of the prepared code */
} native;

/* -- construction ------------------------------------------------------------------------------------ */

static void release(void *code)
{
    native *n = code;
    if (n && n->frame.taped) {
        kmp_backend_tape.release(code);
    } else if (n) {
        kmp_frame_free(&n->frame);
        kmp_free(n);
    }
}

/* From the code that all machines of the program share, in parts for a thread pool. false: no memory. Without segments
 * there is no code. */
static bool take_prepared(native *n, const kmp_program *p, kmp_team *team)
{
    const kmp_prepared *prepared = kmp_prepared_of(p, KMP_X86_ONE, team ? kmp_team_threads(team) : 0);
    if (!prepared || !prepared->code.pages)
        return prepared;
    n->segment = prepared->code.segment;
    return kmp_prepared_frame(prepared, &n->frame, team) && kmp_prepared_values(prepared, &n->frame);
}

static void *share(const kmp_program *p, kmp_team *team)
{
    native *n = KMP_NEW(native, 1);
    bool ok = n && (!kmp_x86_runs(KMP_X86_ONE) || take_prepared(n, p, team));
    if (ok && n->segment)
        return n;
    release(n);
    return ok ? kmp_backend_tape.prepare(p) : NULL;
}

static void *prepare(const kmp_program *p)
{
    return share(p, NULL);
}

/* -- run --------------------------------------------------------------------------------------------- */

static void run_segments(native *n, uint32_t begin, uint32_t end)
{
    for (uint32_t g = begin; g < end; g++) {
        if (n->segment[g])
            n->segment[g](n->frame.v);
        kmp_frame_functions(&n->frame, g);
    }
}

typedef struct piece {
    native *n;
    const uint32_t *first; /* segments of the parts */
    uint32_t stage;        /* the stage's first segment */
} piece;

static void run_part(void *self, int part)
{
    const piece *p = self;
    run_segments(p->n, p->stage + p->first[part], p->stage + p->first[part + 1]);
}

static void run(void *code, int stage)
{
    native *n = code;
    kmp_frame *f = &n->frame;
    if (f->taped) {
        kmp_backend_tape.run(code, stage);
        return;
    }
    const int parts = kmp_frame_parts(f, stage);
    if (parts > 0) {
        /* The segments before the parts; the parts, shared with the thread pool; the segments after them. */
        piece p = {n, f->part_first + f->part_start[stage] + 1, f->stage[stage]};
        run_part(&p, -1);
        kmp_team_run(f->team, parts, run_part, &p);
        run_part(&p, parts);
    } else {
        run_segments(n, f->stage[stage], f->stage[stage + 1]);
    }
    kmp_frame_copies(f, stage);
}

const kmp_backend kmp_backend_native = {"native",          prepare,         release, kmp_frame_set, run,
                                        kmp_frame_outputs, kmp_frame_count, share,   row_code_of,   NULL};

/* -- tape first, then machine code ----------------------------------------------------------------------- */

/* Machine code takes 125 ns an operation to write, the tape 35 ns; a run of it takes 0.5 ns an operation less
 * (limousine63 in docs/decisions/native.md). Code of fewer operations than LEAST is written in half a millisecond. */
enum { RUNS = 200, LEAST_LATER = 4000 };
/* The same for code that later processes take from the cache. */
enum { RUNS_KEPT = 20 };

typedef struct waiting {
    const kmp_program *program;
    const kmp_backend *now; /* tape, then native */
    void *code, *taped;     /* of `now`; the tape's, whose outputs callers may still hold */
    int64_t left;           /* operations to run on the tape; 0: no change will follow */
} waiting;

static void release_either(void *self)
{
    waiting *w = self;
    if (w->code)
        w->now->release(w->code);
    if (w->taped)
        kmp_backend_tape.release(w->taped);
    kmp_free(w);
}

static int runs_of(const kmp_program *p)
{
    kmp_cache_key key;
    return kmp_program_folder(p, KMP_X86_ONE, &key) ? RUNS_KEPT : RUNS;
}

static void *prepare_either(const kmp_program *p)
{
    waiting *w = KMP_NEW(waiting, 1);
    int total = p->code[p->stages];
    bool at_once = total < LEAST_LATER || !kmp_x86_runs(KMP_X86_ONE) || kmp_prepared_known(p, KMP_X86_ONE, 0);
    if (!w)
        return NULL;
    *w = (waiting){.program = p,
                   .now = at_once ? &kmp_backend_native : &kmp_backend_tape,
                   .left = at_once ? 0 : (int64_t)runs_of(p) * total};
    w->code = w->now->prepare(p);
    if (w->code)
        return w;
    kmp_free(w);
    return NULL;
}

/* Goes over to machine code, with the inputs and the values of all earlier stages. Without memory the tape stays. */
static void change_to_native(waiting *w, int stage)
{
    void *code = kmp_backend_native.prepare(w->program);
    w->left = 0;
    if (!code)
        return;
    const kmp_frame *from = w->code, *to = code; /* a frame is the first member of either */
    for (int k = 0; k < from->feed_start[KMP_IN_COUNT]; k++)
        to->v[to->feeds[k].slot] = from->v[from->feeds[k].slot];
    for (int s = 0; s < stage; s++)
        kmp_backend_native.run(code, s);
    w->taped = w->code;
    w->code = code;
    w->now = &kmp_backend_native;
}

static void set_either(void *self, kmp_input_kind kind, const double *values)
{
    const waiting *w = self;
    w->now->set(w->code, kind, values);
}

static void run_either(void *self, int stage)
{
    waiting *w = self;
    if (w->left > 0) {
        w->left -= w->program->code[stage + 1] - w->program->code[stage];
        if (w->left <= 0)
            change_to_native(w, stage);
    }
    w->now->run(w->code, stage);
}

static const double *outputs_of_either(const void *self, int stage)
{
    const waiting *w = self;
    return w->now->outputs(w->code, stage);
}

static void count_either(const void *self, kmp_block_counts *counts)
{
    const waiting *w = self;
    w->now->count(w->code, counts);
    if (w->taped)
        kmp_backend_tape.count(w->taped, counts);
}

const kmp_backend *kmp_backend_waiting(const kmp_backend *backend)
{
    static const kmp_backend either = {"native",          prepare_either, release_either, set_either, run_either,
                                       outputs_of_either, count_either,   NULL,           NULL,       NULL};
    return backend == &kmp_backend_native ? &either : backend;
}

/* SPDX-License-Identifier: BSD-3-Clause */
/* Pieces of a program between two functions, with the values only of places left out, as machine code whose bases are
 * its arguments. A value that leaves its register goes to its row, which no other value has before its last use. */
#include "rail/places/row_code.h"
#include "backend/prepared.h"
#include "base/memory.h"
#include "platform/platform.h"
#include <math.h>

/* KIND: from which on the kinds of these forms of programs are, beyond the kinds of kmp_code_form. LEAST: the number of
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
    kmp_code_address *place;  /* by value */
    uint32_t *offset;         /* of each piece in the code */
} writing;

static bool is_by_slot(const writing *w, int instruction)
{
    return w->address[w->leaves + instruction].base == KMP_ROW_BY_SLOT;
}

/* True for arithmetic, and for the larger one of a value and a constant that is neither zero nor NaN, where the
 * processor's maximum of the constant and the value has the same bits; whose operands have no sign, but for the second
 * one of a sum. Other signs are only in programs from files, and are left to the interpreter. */
static bool is_straight(const kmp_program *p, const kmp_instruction *in)
{
    const bool floor =
        in->op == KMP_OP_MAX && (int)(in->b >> 1) < p->constant_count && fabs(p->constant[in->b >> 1]) > 0;
    return (kmp_code_is_straight(in) || floor) && !(in->a & 1) &&
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

static bool write(writing *w, kmp_written_code *written)
{
    const uint32_t values = (uint32_t)(w->leaves + end_of(w->p));
    kmp_registers registers;
    if (!kmp_registers_init(&registers, &w->arena, values, values, (uint32_t)end_of(w->p), true))
        return false;
    registers.address = w->place;
    for (int k = 0; k < w->count; k++) {
        w->offset[k] = (uint32_t)written->size;
        uint32_t count = 0;
        for (int i = w->piece[k].first; i < w->piece[k].end; i++) {
            const kmp_instruction *in = &w->p->instruction[i];
            if (!is_by_slot(w, i))
                continue;
            const bool one = in->op == KMP_OP_SQRT, floor = in->op == KMP_OP_MAX;
            w->operations[count++] = (kmp_straight){.op = (uint16_t)(floor ? KMP_DO_MAX : kmp_code_op(in)),
                                                    .d = (uint32_t)(w->leaves + i),
                                                    .x = one ? 0 : (floor ? in->b : in->a) >> 1,
                                                    .y = (one || floor ? in->a : in->b) >> 1,
                                                    .kept = w->kept[i]};
        }
        kmp_registers_write(&registers, written, count, w->operations);
    }
    return !written->failed;
}

static bool find_pieces(writing *w)
{
    const int code = end_of(w->p), values = w->leaves + code;
    if (!KMP_ARENA_MAKE(&w->arena, KMP_ROOM(int, code, &w->piece_of), KMP_ROOM(bool, code, &w->kept),
                        KMP_ROOM(kmp_row_piece, code, &w->piece), KMP_ROOM(kmp_straight, code, &w->operations),
                        KMP_ROOM(kmp_code_address, values, &w->place), KMP_ROOM(uint32_t, code, &w->offset)))
        return false;
    /* Addresses of rows; those too far from their base have none. */
    const int32_t most = INT32_MAX / (int32_t)sizeof(double);
    for (int k = 0; k < values; k++) {
        if (w->address[k].at > most)
            return false;
        w->place[k] = (kmp_code_address){(int)w->address[k].base, (int32_t)sizeof(double) * w->address[k].at};
    }
    /* Cuts the stages into pieces at functions. Instructions that depend only on places belong to no piece, and
     * end none. */
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

static bool load_rows(rows *r, const writing *w, const kmp_written_code *written)
{
    r->code.count = w->count;
    r->code.piece = kmp_arena_copy(&r->arena, w->piece, w->count, sizeof *w->piece);
    r->pages = r->code.piece ? kmp_pages_new(written->code, written->size) : NULL;
    r->size = written->size;
    for (int k = 0; r->pages && k < w->count; k++)
        kmp_code_at(r->pages, w->offset[k], &r->code.piece[k].run);
    return r->pages;
}

static rows *write_rows(const kmp_program *program, size_t width, const kmp_row_address *address)
{
    rows *r = KMP_NEW(rows, 1);
    if (!r)
        return NULL;
    const kmp_code_form form = kmp_code_runs(KMP_CODE_EIGHT) ? KMP_CODE_EIGHT : kmp_code_form_of(4);
    kmp_written_code written = {.encoder = kmp_encoder_here(), .form = form};
    writing w = {.p = program, .address = address, .leaves = program->constant_count + program->input_count};
    r->code =
        (kmp_row_code){.form = {.kind = KIND + (int)width, .release = release_rows}, .lanes = kmp_code_at_once(form)};
    bool made = find_pieces(&w) && write(&w, &written) && load_rows(r, &w, &written);
    kmp_written_free(&written);
    kmp_arena_free(&w.arena);
    if (made)
        return r;
    release_rows(&r->code.form);
    return NULL;
}

const kmp_row_code *kmp_row_code_of(const kmp_program *program, size_t width, const kmp_row_address *address)
{
    kmp_program_form *found = kmp_program_find_form(program, KIND + (int)width);
    if (found || !kmp_code_form_of(4))
        return (const kmp_row_code *)found;
    rows *made = write_rows(program, width, address);
    return made ? (const kmp_row_code *)kmp_program_add_form(program, &made->code.form) : NULL;
}

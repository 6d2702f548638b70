/* SPDX-License-Identifier: BSD-3-Clause */
/* Writing a program from another one: import a motion program into a graph, with charts and coordinates replaced; add
 * expressions of the linear algebra; put the outputs of each stage; schedule. The second half runs such a program, and
 * knows when a chart has left the pattern that it was written for. */
#include "constraints/programs/program_writer.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "dynamics/motion.h"
#include "symbolic/contraction.h"
#include "symbolic/function_table.h"
#include "symbolic/ops.h"
#include <math.h>
#include <string.h>

/* Entries of charts that are so in general: C = 1 until a joint comes near a singular position of its angles. */
static bool is_plain(double chart)
{
    return chart == 0 || chart == 1;
}

static int chart_entries(const kempe_system *s)
{
    return KMP_CHART_SIZE * s->chart_count;
}

static bool has_products(const kmp_program_writer *w)
{
    return w->s->late && w->s->late->by_products && w->source == w->s->late->weighing;
}

bool kmp_writer_init(kmp_program_writer *w, const kmp_evaluator *eval, const kmp_program *motion, bool by_bodies,
                     int inputs)
{
    const kempe_system *s = eval->system;
    if (!motion && !by_bodies && !eval->by_products && kmp_motion_need(s) != KEMPE_OK)
        return false;
    motion = motion ? motion : kmp_eval_program(eval, by_bodies);
    *w = (kmp_program_writer){.s = s, .source = motion, .g = kmp_graph_new()};
    w->out = KMP_ARENA_NEW(&w->arena, kmp_ref, w->source->outputs[w->source->stages]);
    if (!KMP_ARENA_EACH(&w->arena, kmp_ref, inputs + s->n + chart_entries(s), &w->input, &w->by) || !w->g)
        return false;
    w->inputs = kmp_writer_plain_charts(eval, w->g, w->input, w->by);
    if (!has_products(w))
        return true;
    w->product = KMP_ARENA_NEW(&w->arena, kmp_ref, w->source->outputs[w->source->stages]);
    w->accelerations = w->inputs;
    for (int i = 0; i < s->n; i++)
        kmp_writer_replace(w, KMP_IN_QDD, i, KMP_ZERO);
    return w->product;
}

int kmp_writer_plain_charts(const kmp_evaluator *eval, kmp_graph *g, kmp_ref *input, kmp_ref *by)
{
    int count = 0;
    for (int k = 0; k < chart_entries(eval->system); k++)
        if (is_plain(eval->chart[k])) {
            input[count] = kmp_input(g, KMP_IN_CHART, (uint32_t)k);
            by[count++] = eval->chart[k] == 0 ? KMP_ZERO : KMP_ONE;
        }
    return count;
}

void kmp_writer_free(kmp_program_writer *w)
{
    kmp_graph_free(w->g);
    kmp_arena_free(&w->arena);
}

void kmp_writer_replace(kmp_program_writer *w, kmp_input_kind kind, int index, kmp_ref by)
{
    w->input[w->inputs] = kmp_input(w->g, kind, (uint32_t)index);
    w->by[w->inputs++] = by;
}

/* The value of a coordinate, which has a position in the state. */
static kmp_ref place_of(const kmp_program_writer *w, int coordinate, uint32_t position)
{
    return kmp_input(w->g, KMP_IN_Q, w->by_coordinate ? (uint32_t)coordinate : position);
}

void kmp_writer_take_state(kmp_program_writer *w, const kmp_partition *part)
{
    uint32_t p = (uint32_t)part->p, r = (uint32_t)part->r;
    w->named = w->inputs;
    for (uint32_t c = 0; c < p; c++) {
        kmp_writer_replace(w, KMP_IN_Q, part->u[c], place_of(w, part->u[c], c));
        kmp_writer_replace(w, KMP_IN_QD, part->u[c], kmp_writer_rate(w, part, part->u[c]));
    }
    for (uint32_t i = 0; i < r; i++) {
        kmp_writer_replace(w, KMP_IN_Q, part->v[i], place_of(w, part->v[i], 2 * p + i));
        kmp_writer_replace(w, KMP_IN_QD, part->v[i], kmp_writer_rate(w, part, part->v[i]));
    }
}

kmp_ref kmp_writer_rate(const kmp_program_writer *w, const kmp_partition *part, int coordinate)
{
    if (!part || w->by_coordinate)
        return kmp_input(w->g, KMP_IN_QD, (uint32_t)coordinate);
    for (int c = 0; c < part->p; c++)
        if (part->u[c] == coordinate)
            return kmp_input(w->g, KMP_IN_Q, (uint32_t)(part->p + c));
    int i = 0;
    while (part->v[i] != coordinate)
        i++;
    return kmp_input(w->g, KMP_IN_QD, (uint32_t)(2 * part->p + part->r + i));
}

bool kmp_writer_take_rates(kmp_program_writer *w, const kmp_partition *part, const kmp_ref *rate)
{
    for (int i = 0; i < part->r; i++)
        w->by[w->named + 2 * (part->p + i) + 1] = rate[i];
    return kmp_writer_import(w);
}

/* The first stages, 0: all, into `out`. */
static bool import_into(kmp_program_writer *w, int stages, kmp_ref *out)
{
    const kmp_importing how = {
        .stages = stages, .count = w->inputs, .input = w->input, .by = w->by, .at = w->at, .turns = &w->turns};
    return kmp_program_import(w->source, w->g, &how, out);
}

static bool import(kmp_program_writer *w, int stages)
{
    const kempe_system *s = w->s;
    if (!import_into(w, stages, w->out))
        return false;
    w->closure = w->h = w->out + w->source->outputs[KMP_STAGE_CLOSURE];
    w->jacobian = w->h + s->m;
    w->h_t = s->rheonomic ? w->jacobian + s->jacobian.count : NULL;
    return true;
}

bool kmp_writer_import(kmp_program_writer *w)
{
    const kempe_system *s = w->s;
    const int *first = w->source->outputs;
    bool by_bodies = w->source == s->bodies->program, by_products = has_products(w);
    if (!import(w, 0))
        return false;
    const kmp_ref *mass = w->out + first[KMP_STAGE_MASS];
    w->mass = by_bodies || by_products ? NULL : mass;
    w->pivots = by_bodies ? mass : NULL;
    w->diagonals = by_bodies ? mass + s->m : NULL;
    w->open = by_bodies ? w->out + first[KMP_STAGE_OPEN] : NULL;
    w->correction = by_bodies ? w->out + first[KMP_STAGE_CORRECT] : NULL;
    bool loaded = !by_bodies && s->load_row_count > 0;
    w->bias = w->out + first[loaded ? KMP_STAGE_LOAD : KMP_STAGE_BIAS];
    w->load = loaded ? w->bias + s->n : NULL;
    w->jdqd = loaded ? w->out + first[KMP_STAGE_BIAS] : w->bias + s->n;
    w->power = w->source->stages > KMP_STAGE_WORKING ? w->out[first[KMP_STAGE_WORKING]] : KMP_ZERO;
    return true;
}

bool kmp_writer_product(kmp_program_writer *w, const kmp_ref *x, kmp_ref *out)
{
    const size_t n = (size_t)w->s->n;
    memcpy(w->by + w->accelerations, x, n * sizeof *x);
    if (!import_into(w, 0, w->product))
        return false;
    memcpy(out, w->product + w->source->outputs[KMP_STAGE_PRODUCT], n * sizeof *out);
    return true;
}

/* -- count --------------------------------------------------------------------------------------------- */

typedef enum known_number { ANY, NUMBER_ZERO, NUMBER_ONE } known_number;

static known_number number_of(double x)
{
    return x == 0 ? NUMBER_ZERO : x == 1 ? NUMBER_ONE : ANY;
}

/* Returns the constant value of an instruction, as far as it is known; *free: it needs no operation. */
static known_number simplify(const kmp_instruction *in, const known_number *known, bool *free)
{
    known_number a = known[in->a >> 1], b = kmp_op_arity((kmp_op)in->op) > 1 ? known[in->b >> 1] : ANY;
    bool product = in->op == KMP_OP_MUL;
    bool zero = a == NUMBER_ZERO || b == NUMBER_ZERO, both = a == NUMBER_ZERO && b == NUMBER_ZERO;
    *free = product ? zero || a == NUMBER_ONE || b == NUMBER_ONE : in->op == KMP_OP_ADD && zero;
    return (product && zero) || (in->op == KMP_OP_ADD && both) ? NUMBER_ZERO : ANY;
}

double kmp_writer_operations(const kmp_evaluator *eval, bool by_bodies)
{
    if (!by_bodies && kmp_motion_need(eval->system) != KEMPE_OK)
        return -1;
    const kmp_program *p = by_bodies ? eval->system->bodies->program : eval->system->motion;
    int leaves = p->constant_count + p->input_count;
    known_number *known = KMP_NEW(known_number, leaves + p->code[p->stages]);
    double count = known ? 0 : -1;
    for (int k = 0; known && k < p->constant_count; k++)
        known[k] = number_of(p->constant[k]);
    for (int k = 0; known && k < p->input_count; k++)
        if (p->input[k].kind == KMP_IN_CHART)
            known[p->constant_count + k] = number_of(eval->chart[p->input[k].index]);
    for (int i = 0; known && i < p->code[KMP_STAGE_BIAS + 1]; i++) {
        bool free = false;
        if (kmp_op_form_of((kmp_op)p->instruction[i].op) == KMP_FORM_INFIX)
            known[leaves + i] = simplify(&p->instruction[i], known, &free);
        count += i >= p->code[KMP_STAGE_CLOSURE] && !free;
    }
    kmp_free(known);
    return count;
}

void kmp_writer_add_efforts(kmp_program_writer *w)
{
    for (int i = 0; w->s->force && (w->mass || w->product) && i < w->s->n;
         i++) /* C has generalized forces with their sign changed */
        w->bias[i] = kmp_sub(w->g, w->bias[i], kmp_input(w->g, KMP_IN_EFFORT, (uint32_t)i));
}

bool kmp_writer_room(kmp_program_writer *w, int outputs)
{
    w->all = w->to = KMP_ARENA_NEW(&w->arena, kmp_ref, outputs);
    return w->all;
}

void kmp_writer_stage(kmp_program_writer *w)
{
    w->group[w->stages++] = w->to;
}

void kmp_writer_put(kmp_program_writer *w, int count, const kmp_ref *of)
{
    if (of == w->closure)
        w->exact = (int)(w->to - w->all);
    if (count > 0)
        memcpy(w->to, of, (size_t)count * sizeof *of);
    w->to += count;
    w->count[w->stages - 1] += count;
}

int kmp_writer_closure_count(const kempe_system *s)
{
    return (s->rheonomic ? 2 : 1) * s->m + s->jacobian.count;
}

kmp_program *kmp_writer_program(kmp_program_writer *w)
{
    kmp_program *p = kmp_graph_failed(w->g) ? NULL : kmp_program_new(w->g, w->stages, w->count, w->group);
    int end = w->exact + kmp_writer_closure_count(w->s);
    if (!p || kmp_program_contract(p, w->exact, end))
        return p;
    kmp_program_free(p);
    return NULL;
}

/* -- running ------------------------------------------------------------------------------------------- */

static void run_constants(kmp_writer_machine *w)
{
    kmp_machine_set(w->machine, KMP_IN_CHART, w->eval->chart);
    (void)kmp_machine_run(w->machine, KMP_STAGE_PARAMETERS);
    for (int k = 0; k < chart_entries(w->eval->system); k++)
        w->stale = w->stale || (is_plain(w->chart[k]) && w->chart[k] != w->eval->chart[k]);
    w->chart_version = w->eval->chart_version;
}

bool kmp_writer_machine_init(kmp_writer_machine *w, const kmp_evaluator *eval, kmp_program *program)
{
    int charts = chart_entries(eval->system);
    *w = (kmp_writer_machine){.eval = eval, .program = program, .chart = KMP_NEW(double, charts)};
    w->machine = program && w->chart ? kmp_machine_new(program, eval->backend) : NULL;
    if (!w->machine)
        return false;
    for (int k = 0; k < charts; k++)
        w->chart[k] = eval->chart[k];
    for (int k = 0; k < program->input_count; k++)
        w->reads[program->input[k].kind] = true;
    kmp_machine_set(w->machine, KMP_IN_PARAMETER, eval->system->parameters);
    run_constants(w);
    return true;
}

void kmp_writer_machine_free(kmp_writer_machine *w)
{
    kmp_machine_free(w->machine);
    kmp_program_free(w->program);
    kmp_free(w->chart);
}

void kmp_writer_machine_place(kmp_writer_machine *w, double t, const double *q)
{
    if (w->reads[KMP_IN_MODE])
        kmp_machine_set(w->machine, KMP_IN_MODE, w->eval->conditions.mode);
    if (w->reads[KMP_IN_TIME])
        kmp_machine_set(w->machine, KMP_IN_TIME, kmp_present_inputs_at(&w->eval->inputs, t));
    kmp_machine_set(w->machine, KMP_IN_Q, q);
}

kmp_writer_correction kmp_writer_machine_close(kmp_writer_machine *w, int stage, int r, int turns, double t,
                                               const double *y)
{
    double turn = 0;
    kmp_writer_machine_place(w, t, y);
    const double *dv = kmp_machine_run(w->machine, stage), *angle = dv + r;
    for (int k = 0; k < turns; k++)
        turn = fabs(angle[k]) <= turn ? turn : fabs(angle[k]);
    return (kmp_writer_correction){dv, turn};
}

void kmp_writer_put_efforts(kmp_writer_machine *w, const kmp_writer_efforts *room, const kmp_partition *part, double t,
                            const double *y, const double *dv, const double *rate)
{
    int p = part->p, r = part->r;
    for (int c = 0; c < p; c++) {
        room->q[part->u[c]] = y[c];
        room->qd[part->u[c]] = y[p + c];
    }
    for (int i = 0; i < r; i++) {
        room->q[part->v[i]] = y[2 * p + i] + (dv ? dv[i] : 0);
        room->qd[part->v[i]] = room->state[2 * p + r + i] = rate[i];
    }
    kmp_machine_set(w->machine, KMP_IN_QD, room->state);
    kmp_system_effort(w->eval->system, t, room->q, room->qd, room->effort);
    kmp_machine_set(w->machine, KMP_IN_EFFORT, room->effort);
}

bool kmp_writer_machine_is_stale(kmp_writer_machine *w)
{
    if (w->chart_version != w->eval->chart_version)
        run_constants(w);
    return w->stale;
}

bool kmp_writer_machine_applies(kmp_writer_machine *w)
{
    return !kmp_writer_machine_is_stale(w) && (w->eval->conditions.frozen || w->eval->system->events.count == 0);
}

/* Expressions for Jv^-1, block by block from the last to the first. The order of elimination in a block is the order
 * of complete pivoting at the state where the program is written; bounds of the multipliers show at other states where
 * it fails. */

/* A diagonal block: its matrix, then its factors; rows in the order of elimination. */
struct kmp_writer_block {
    int size, row[KMP_WRITER_BLOCK], col[KMP_WRITER_BLOCK];
    kmp_ref a[KMP_WRITER_BLOCK][KMP_WRITER_BLOCK];
    kmp_ref inverse[KMP_WRITER_BLOCK]; /* of the pivots; for two rows: of the determinant */
};

bool kmp_writer_order_is_good(int count, const kmp_eliminated *rows, const double *multiplier, const double *row_scale,
                              size_t stride)
{
    for (int k = 0; k < count; k++) {
        double by = row_scale[(size_t)rows[k].by * stride], row = row_scale[(size_t)rows[k].row * stride];
        if (!(fabs(multiplier[(size_t)k * stride]) * by <= KMP_ELIMINATION * row))
            return false;
    }
    return true;
}

void kmp_writer_order(const kmp_reduction *red, int *order)
{
    const double *scale = red->eval->system->row_scale;
    double value[KMP_WRITER_BLOCK * KMP_WRITER_BLOCK];
    int size, pivot[KMP_WRITER_BLOCK];
    for (int number = 0, count = kmp_block_count(red->block); number < count; number++, order += size) {
        const int *col = kmp_block_columns(red->block, number, &size), *row = kmp_block_rows(red->block, number);
        memcpy(order, row, (size_t)size * sizeof *order);
        if (size <= 2) /* by the determinant */
            continue;
        for (int i = 0; i < size; i++)
            for (int j = 0; j < size; j++) {
                int e = 0;
                while (e < red->jv_count && (red->jv_row[e] != row[i] || red->jv_col[e] != col[j]))
                    e++;
                double entry = e < red->jv_count ? red->eval->jacobian[red->jv_entry[e]] : 0;
                value[i + j * size] = entry / scale[red->part->rows[row[i]]];
            }
        int fault = kmp_lu_factor(size, value, pivot);
        for (int i = 0; i < (fault ? fault - 1 : size); i++)
            kmp_swap_int(&order[i], &order[pivot[i]]);
    }
}

/* x = A^-1 x, or by the transpose of A; the diagonal belongs to the upper triangle of A. */
static void solve_block(kmp_graph *g, const struct kmp_writer_block *b, bool transposed, kmp_ref *x)
{
    kmp_ref a[KMP_WRITER_BLOCK][KMP_WRITER_BLOCK];
    for (int i = 0; i < b->size; i++)
        for (int j = 0; j < b->size; j++)
            a[i][j] = transposed ? b->a[j][i] : b->a[i][j];
    if (b->size == 2) {
        kmp_ref y = x[0], z = x[1], w = b->inverse[0];
        x[0] = kmp_sub(g, kmp_mul(g, kmp_mul(g, a[1][1], w), y), kmp_mul(g, kmp_mul(g, a[0][1], w), z));
        x[1] = kmp_sub(g, kmp_mul(g, kmp_mul(g, a[0][0], w), z), kmp_mul(g, kmp_mul(g, a[1][0], w), y));
        return;
    }
    for (int i = 0; i < b->size; i++) {
        for (int j = 0; j < i; j++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, a[i][j], x[j]));
        if (transposed)
            x[i] = kmp_mul(g, x[i], b->inverse[i]);
    }
    for (int i = b->size - 1; i >= 0; i--) {
        for (int j = i + 1; j < b->size; j++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, a[i][j], x[j]));
        if (!transposed)
            x[i] = kmp_mul(g, x[i], b->inverse[i]);
    }
}

/* The right-hand side of a row minus the known part of the solution: columns of later blocks. */
static kmp_ref left_over(const kmp_writer_blocks *k, int row, kmp_ref rhs, const kmp_ref *x, int stride, int number)
{
    for (int col = 0; col < k->red->r; col++)
        if (k->block_of[col] > number && k->jv[row * k->red->r + col] != KMP_ZERO)
            rhs = kmp_sub(k->g, rhs, kmp_mul(k->g, k->jv[row * k->red->r + col], x[col * stride]));
    return rhs;
}

void kmp_writer_blocks_solve(const kmp_writer_blocks *k, int number, int columns, const kmp_ref *rhs, kmp_ref *x)
{
    const struct kmp_writer_block *b = &k->block[number];
    for (int c = 0; c < columns; c++) {
        kmp_ref y[KMP_WRITER_BLOCK] = {0};
        for (int i = 0; i < b->size; i++)
            y[i] = left_over(k, b->row[i], rhs[b->row[i] * columns + c], x + c, columns, number);
        solve_block(k->g, b, false, y);
        for (int i = 0; i < b->size; i++)
            x[b->col[i] * columns + c] = y[i];
    }
}

bool kmp_writer_blocks_init(kmp_writer_blocks *k, kmp_arena *arena, kmp_graph *g, const kmp_ref *jacobian)
{
    int r = k->red->r;
    k->g = g;
    KMP_ARENA_MAKE(arena, KMP_ROOM(struct kmp_writer_block, kmp_block_count(k->red->block), &k->block),
                   KMP_ROOM(int, r, &k->block_of), KMP_ROOM(kmp_eliminated, r * KMP_WRITER_BLOCK, &k->row),
                   KMP_ROOM(kmp_ref, r * k->red->p, &k->ju), KMP_ROOM(kmp_ref, r * KMP_WRITER_BLOCK, &k->multiplier),
                   KMP_ROOM(kmp_ref, r, &k->pivot));
    if (!KMP_ARENA_EACH(arena, kmp_ref, r * r, &k->jv))
        return false;
    /* Sorts the entries of J into Jv and Ju. */
    const kmp_reduction *red = k->red;
    for (int e = 0; e < red->jv_count; e++)
        k->jv[red->jv_row[e] * red->r + red->jv_col[e]] = jacobian[red->jv_entry[e]];
    for (int e = 0; e < red->ju_count; e++)
        k->ju[red->ju_row[e] * red->p + red->ju_col[e]] = jacobian[red->ju_entry[e]];
    for (int number = kmp_block_count(red->block); number-- > 0;) {
        int size;
        const int *col = kmp_block_columns(red->block, number, &size);
        for (int i = 0; i < size; i++)
            k->block_of[col[i]] = number;
    }
    return true;
}

void kmp_writer_blocks_factor(kmp_writer_blocks *k, int number)
{
    /* Rows of a block in the order of elimination. */
    struct kmp_writer_block *b = &k->block[number];
    const int *col = kmp_block_columns(k->red->block, number, &b->size), *order = k->order;
    for (int before = 0, size; before < number; before++, order += size)
        (void)kmp_block_columns(k->red->block, before, &size);
    for (int i = 0; i < b->size; i++) {
        b->col[i] = col[i];
        b->row[i] = order[i];
    }
    for (int i = 0; i < b->size; i++)
        for (int j = 0; j < b->size; j++)
            b->a[i][j] = k->jv[b->row[i] * k->red->r + b->col[j]];
    /* Factors a block. One row: its inverse. Two rows: the inverse of the determinant. More: L below the diagonal, U on
     * and above it. */
    kmp_graph *g = k->g;
    if (b->size == 2) {
        kmp_ref det = kmp_sub(g, kmp_mul(g, b->a[0][0], b->a[1][1]), kmp_mul(g, b->a[0][1], b->a[1][0]));
        b->inverse[0] = kmp_div(g, KMP_ONE, det);
        k->pivot[k->pivots++] = det;
        return;
    }
    for (int c = 0; c < b->size; c++) {
        k->pivot[k->pivots++] = b->a[c][c];
        b->inverse[c] = kmp_div(g, KMP_ONE, b->a[c][c]);
        for (int i = c + 1; i < b->size; i++) {
            if (b->a[i][c] == KMP_ZERO)
                continue;
            b->a[i][c] = kmp_mul(g, b->a[i][c], b->inverse[c]);
            k->multiplier[k->multipliers] = b->a[i][c];
            k->row[k->multipliers++] =
                (kmp_eliminated){.row = k->red->part->rows[b->row[i]], .by = k->red->part->rows[b->row[c]]};
            for (int j = c + 1; j < b->size; j++)
                b->a[i][j] = kmp_sub(g, b->a[i][j], kmp_mul(g, b->a[i][c], b->a[c][j]));
        }
    }
}

/* The right-hand side of a column minus the known part of the solution: rows of earlier blocks. */
static kmp_ref left_over_transposed(const kmp_writer_blocks *k, int col, kmp_ref rhs, const kmp_ref *x, int number)
{
    for (int before = 0; before < number; before++)
        for (int i = 0; i < k->block[before].size; i++) {
            const int row = k->block[before].row[i];
            kmp_ref entry = k->jv[row * k->red->r + col];
            if (entry != KMP_ZERO)
                rhs = kmp_sub(k->g, rhs, kmp_mul(k->g, entry, x[row]));
        }
    return rhs;
}

void kmp_writer_blocks_solve_transposed(const kmp_writer_blocks *k, const kmp_ref *rhs, kmp_ref *x)
{
    for (int number = 0; number < kmp_block_count(k->red->block); number++) {
        const struct kmp_writer_block *b = &k->block[number];
        kmp_ref y[KMP_WRITER_BLOCK] = {0};
        for (int i = 0; i < b->size; i++)
            y[i] = left_over_transposed(k, b->col[i], rhs[b->col[i]], x, number);
        solve_block(k->g, b, true, y);
        for (int i = 0; i < b->size; i++)
            x[b->row[i]] = y[i];
    }
}

void kmp_writer_blocks_correct(const kmp_writer_blocks *k, const kmp_ref *h, kmp_ref *room, kmp_ref *x)
{
    for (int i = 0; i < k->red->r; i++)
        room[i] = h[k->red->part->rows[i]];
    for (int number = kmp_block_count(k->red->block); number-- > 0;)
        kmp_writer_blocks_solve(k, number, 1, room, x);
    for (int i = 0; i < k->red->r; i++)
        x[i] = kmp_neg(x[i]);
}

bool kmp_writer_close(kmp_program_writer *w, kmp_writer_blocks k, kmp_ref *dv)
{
    kmp_ref *room = KMP_ARENA_NEW(&w->arena, kmp_ref, k.red->r);
    if (!room || !import(w, KMP_STAGE_CLOSURE + 1) || !kmp_writer_blocks_init(&k, &w->arena, w->g, w->jacobian))
        return false;
    for (int number = kmp_block_count(k.red->block); number-- > 0;)
        kmp_writer_blocks_factor(&k, number);
    kmp_writer_blocks_correct(&k, w->h, room, dv);
    /* Later imports take the corrected state. */
    w->at = KMP_ARENA_NEW(&w->arena, kmp_ref, w->inputs);
    w->turns.angle = KMP_ARENA_NEW(&w->arena, kmp_ref, w->source->code[w->source->stages]);
    if (!w->at || !w->turns.angle)
        return false;
    memcpy(w->at, w->by, (size_t)w->inputs * sizeof *w->at);
    for (int i = 0; i < k.red->part->r; i++) {
        kmp_ref *v = &w->by[w->named + 2 * (k.red->part->p + i)];
        *v = kmp_add(w->g, *v, dv[i]);
    }
    return true;
}

kmp_ref kmp_writer_blocks_excess(const kmp_writer_blocks *k)
{
    const double *row_scale = k->red->eval->system->row_scale;
    kmp_ref most = KMP_ZERO;
    for (int i = 0; i < k->multipliers; i++) {
        double bound = KMP_ELIMINATION * row_scale[k->row[i].row] / row_scale[k->row[i].by];
        kmp_ref part = kmp_mul(k->g, kmp_unary(k->g, KMP_OP_ABS, k->multiplier[i]), kmp_const(k->g, 1 / bound));
        most = i > 0 ? kmp_binary(k->g, KMP_OP_MAX, most, part) : part;
    }
    return most;
}

kmp_eliminated *kmp_writer_rows(const kmp_writer_blocks *k)
{
    kmp_eliminated *row = KMP_NEW(kmp_eliminated, 1 + k->multipliers);
    if (row && k->multipliers > 0)
        memcpy(row, k->row, (size_t)k->multipliers * sizeof *row);
    return row;
}

bool kmp_writer_blocks_fit(const kmp_reduction *red)
{
    return kmp_block_largest(red->block) <= KMP_WRITER_BLOCK;
}

/* L D L' over expressions: the order by least degree on the pattern, then columns of L from those before. Entries that
 * are zero by the pattern are never made. */

/* -- order --------------------------------------------------------------------------------------------- */

/* State of the search for an order. */
typedef struct search {
    kmp_writer_ldl *ldl;
    unsigned char *pattern;
    int *degree; /* of each unknown: neighbours that are not eliminated yet */
    int *waits;  /* of a trailing unknown: leading ones among them */
    int *list;
} search;

static const unsigned char *row_of(const search *s, int i)
{
    return s->pattern + (size_t)i * (size_t)s->ldl->size;
}

static void count_neighbours(const search *s, int i)
{
    const kmp_writer_ldl *ldl = s->ldl;
    const unsigned char *row = row_of(s, i);
    s->degree[i] = s->waits[i] = 0;
    for (int j = 0; j < ldl->size; j++) {
        bool coupled = row[j] && j != i && ldl->step[j] < 0;
        s->degree[i] += coupled;
        s->waits[i] += coupled && i >= ldl->leading && j < ldl->leading;
    }
}

/* Eliminates an unknown, which couples its neighbours with each other. Returns their number. */
static long eliminate(const search *s, int i, int step)
{
    /* Lists the neighbours of an unknown that are not eliminated. */
    const unsigned char *row = row_of(s, i);
    int count = 0;
    for (int j = 0; j < s->ldl->size; j++)
        if (row[j] && j != i && s->ldl->step[j] < 0)
            s->list[count++] = j;
    size_t size = (size_t)s->ldl->size;
    s->ldl->order[step] = i;
    s->ldl->step[i] = step;
    for (int a = 0; a < count; a++)
        for (int b = 0; b < count; b++)
            s->pattern[(size_t)s->list[a] * size + (size_t)s->list[b]] = 1;
    for (int a = 0; a < count; a++)
        count_neighbours(s, s->list[a]);
    return count;
}

/* Returns the entries of L. */
static int find_order(const search *s)
{
    kmp_writer_ldl *ldl = s->ldl;
    int entries = 0;
    for (int i = 0; i < ldl->size; i++)
        ldl->step[i] = -1;
    for (int i = 0; i < ldl->size; i++)
        count_neighbours(s, i);
    for (int k = 0; k < ldl->size; k++) {
        int best = -1; /* the unknown of least degree, the last one of several: in a tree of bodies leaves come first */
        for (int i = ldl->size; i-- > 0;)
            if (ldl->step[i] < 0 && s->waits[i] == 0 && (best < 0 || s->degree[i] < s->degree[best]))
                best = i;
        long degree = eliminate(s, best, k);
        entries += (int)degree;
        ldl->operations += 2 + degree * (degree + 6);
    }
    return entries;
}

/* Lists the entries of L by columns, in the order of elimination; counts them by rows. */
static void list_columns(kmp_writer_ldl *ldl, const unsigned char *pattern)
{
    size_t size = (size_t)ldl->size;
    int entries = 0;
    for (int k = 0; k < ldl->size; k++) {
        const unsigned char *row = pattern + (size_t)ldl->order[k] * size;
        for (int later = k + 1; later < ldl->size; later++)
            if (row[ldl->order[later]]) {
                ldl->row[entries++] = ldl->order[later];
                ldl->row_start[ldl->order[later] + 1]++;
            }
        ldl->start[k + 1] = entries;
    }
}

bool kmp_writer_ldl_analyse(kmp_writer_ldl *ldl, kmp_arena *arena, int size, int leading, unsigned char *pattern)
{
    *ldl = (kmp_writer_ldl){.size = size, .leading = leading};
    search s = {.ldl = ldl, .pattern = pattern};
    KMP_ARENA_EACH(arena, int, size, &ldl->order, &ldl->step, &s.degree, &s.waits, &s.list);
    if (!KMP_ARENA_EACH(arena, int, size + 1, &ldl->start, &ldl->row_start))
        return false;
    int entries = find_order(&s);
    if (!KMP_ARENA_EACH(arena, int, entries, &ldl->row, &ldl->col, &ldl->at))
        return false;
    list_columns(ldl, pattern);
    /* Lists them by rows. `next`: room for `size`. */
    for (int i = 0; i < ldl->size; i++) {
        ldl->row_start[i + 1] += ldl->row_start[i];
        s.list[i] = ldl->row_start[i];
    }
    for (int k = 0; k < ldl->size; k++)
        for (int e = ldl->start[k]; e < ldl->start[k + 1]; e++) {
            int to = s.list[ldl->row[e]]++;
            ldl->col[to] = k;
            ldl->at[to] = e;
        }
    return true;
}

/* -- factors ------------------------------------------------------------------------------------------- */

/* x minus the products of earlier steps for an entry of L D. */
static kmp_ref reduce(const kmp_writer_ldl *ldl, kmp_graph *g, int i, int j, kmp_ref x)
{
    int a = ldl->row_start[i], b = ldl->row_start[j];
    while (a < ldl->row_start[i + 1] && b < ldl->row_start[j + 1]) {
        if (ldl->col[a] == ldl->col[b])
            x = kmp_sub(g, x, kmp_mul(g, ldl->l[ldl->at[a]], ldl->scaled[ldl->at[b]]));
        int step = ldl->col[a];
        a += step <= ldl->col[b];
        b += step >= ldl->col[b];
    }
    return x;
}

/* x minus the products of earlier steps of leading or of trailing unknowns for the diagonal. */
static kmp_ref reduce_diagonal(const kmp_writer_ldl *ldl, kmp_graph *g, int i, bool leading, kmp_ref x)
{
    for (int a = ldl->row_start[i]; a < ldl->row_start[i + 1]; a++)
        if ((ldl->order[ldl->col[a]] < ldl->leading) == leading)
            x = kmp_sub(g, x, kmp_mul(g, ldl->l[ldl->at[a]], ldl->scaled[ldl->at[a]]));
    return x;
}

/* Column k of L, from the columns before it. The Schur complement gives the diagonal of a trailing unknown. */
static bool factor_column(kmp_writer_ldl *ldl, kmp_graph *g, int k, const kmp_ref *matrix)
{
    int i = ldl->order[k], size = ldl->size;
    kmp_ref diagonal = matrix[i * size + i], reduced = reduce_diagonal(ldl, g, i, true, diagonal);
    ldl->diagonal[i] = i < ldl->leading ? diagonal : reduced;
    ldl->pivot[i] = reduce_diagonal(ldl, g, i, false, reduced);
    if (ldl->pivot[i] == KMP_ZERO)
        return false;
    ldl->inverse[i] = kmp_div(g, KMP_ONE, ldl->pivot[i]);
    for (int e = ldl->start[k]; e < ldl->start[k + 1]; e++) {
        ldl->scaled[e] = reduce(ldl, g, ldl->row[e], i, matrix[ldl->row[e] * size + i]);
        ldl->l[e] = kmp_mul(g, ldl->scaled[e], ldl->inverse[i]);
    }
    return true;
}

bool kmp_writer_ldl_factor(kmp_writer_ldl *ldl, kmp_arena *arena, kmp_graph *g, const kmp_ref *matrix)
{
    int entries = ldl->start[ldl->size];
    KMP_ARENA_EACH(arena, kmp_ref, entries, &ldl->l, &ldl->scaled);
    if (!KMP_ARENA_EACH(arena, kmp_ref, ldl->size, &ldl->diagonal, &ldl->pivot, &ldl->inverse))
        return false;
    for (int k = 0; k < ldl->size; k++)
        if (!factor_column(ldl, g, k, matrix))
            return false;
    return true;
}

void kmp_writer_ldl_solve(const kmp_writer_ldl *ldl, kmp_graph *g, int unknowns, kmp_ref *x)
{
    for (int k = 0; k < ldl->size; k++) {
        int i = ldl->order[k];
        for (int a = ldl->row_start[i]; i < unknowns && a < ldl->row_start[i + 1]; a++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, ldl->l[ldl->at[a]], x[ldl->order[ldl->col[a]]]));
    }
    for (int k = ldl->size; k-- > 0;) {
        int i = ldl->order[k];
        if (i >= unknowns)
            continue;
        x[i] = kmp_mul(g, x[i], ldl->inverse[i]);
        for (int e = ldl->start[k]; e < ldl->start[k + 1]; e++)
            if (ldl->row[e] < unknowns)
                x[i] = kmp_sub(g, x[i], kmp_mul(g, ldl->l[e], x[ldl->row[e]]));
    }
}

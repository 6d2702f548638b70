/* SPDX-License-Identifier: BSD-3-Clause */
/* Writing a program from another one: import a motion program into a graph, with charts and coordinates replaced; add
 * expressions of the linear algebra; put the outputs of each stage; schedule. The second half runs such a program, and
 * knows when a chart has left the pattern that it was written for. */
#include "constraints/programs/program_writer.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "dynamics/motion.h"
#include "symbolic/contraction.h"
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

bool kmp_writer_init(kmp_program_writer *w, const kmp_evaluator *eval, const kmp_program *motion, bool by_bodies,
                     int inputs)
{
    const kempe_system *s = eval->system;
    if (!motion && !by_bodies && kmp_motion_need(s) != KEMPE_OK)
        return false;
    motion = motion ? motion : by_bodies ? s->bodies->program : s->motion;
    *w = (kmp_program_writer){.s = s, .source = motion, .g = kmp_graph_new()};
    w->out = KMP_ARENA_NEW(&w->arena, kmp_ref, w->source->outputs[w->source->stages]);
    if (!KMP_ARENA_EACH(&w->arena, kmp_ref, inputs + chart_entries(s), &w->input, &w->by) || !w->g)
        return false;
    w->inputs = kmp_writer_plain_charts(eval, w->g, w->input, w->by);
    return true;
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

bool kmp_writer_correct(kmp_program_writer *w, const kmp_partition *part, const kmp_ref *dv)
{
    w->at = KMP_ARENA_NEW(&w->arena, kmp_ref, w->inputs);
    w->turns.angle = KMP_ARENA_NEW(&w->arena, kmp_ref, w->source->code[w->source->stages]);
    if (!w->at || !w->turns.angle)
        return false;
    memcpy(w->at, w->by, (size_t)w->inputs * sizeof *w->at);
    for (int i = 0; i < part->r; i++) {
        kmp_ref *v = &w->by[w->named + 2 * (part->p + i)];
        *v = kmp_add(w->g, *v, dv[i]);
    }
    return true;
}

/* The first stages; 0: all. */
static bool import(kmp_program_writer *w, int stages)
{
    const kmp_importing how = {
        .stages = stages, .count = w->inputs, .input = w->input, .by = w->by, .at = w->at, .turns = &w->turns};
    const kempe_system *s = w->s;
    if (!kmp_program_import(w->source, w->g, &how, w->out))
        return false;
    w->closure = w->h = w->out + w->source->outputs[KMP_STAGE_CLOSURE];
    w->jacobian = w->h + s->m;
    w->h_t = s->rheonomic ? w->jacobian + s->jacobian.count : NULL;
    return true;
}

bool kmp_writer_import_closure(kmp_program_writer *w)
{
    return import(w, KMP_STAGE_CLOSURE + 1);
}

bool kmp_writer_import(kmp_program_writer *w)
{
    const kempe_system *s = w->s;
    const int *first = w->source->outputs;
    bool by_bodies = w->source == s->bodies->program;
    if (!import(w, 0))
        return false;
    const kmp_ref *mass = w->out + first[KMP_STAGE_MASS];
    w->mass = by_bodies ? NULL : mass;
    w->compliance = by_bodies ? mass : NULL;
    w->mobility = by_bodies ? mass + s->bodies->compliance.count : NULL;
    bool loaded = !by_bodies && s->load_row_count > 0;
    w->bias = w->out + first[loaded ? KMP_STAGE_LOAD : KMP_STAGE_BIAS];
    w->load = loaded ? w->bias + s->n : NULL;
    w->jdqd = loaded ? w->out + first[KMP_STAGE_BIAS] : w->bias + s->n;
    w->power = w->source->stages > KMP_STAGE_WORKING ? w->out[first[KMP_STAGE_WORKING]] : KMP_ZERO;
    return true;
}

/* -- count --------------------------------------------------------------------------------------------- */

typedef enum number { ANY, NUMBER_ZERO, NUMBER_ONE } number;

static number number_of(double x)
{
    return x == 0 ? NUMBER_ZERO : x == 1 ? NUMBER_ONE : ANY;
}

/* Returns the constant value of an instruction, as far as it is known; *free: it needs no operation. */
static number simplify(const kmp_instruction *in, const number *known, bool *free)
{
    number a = known[in->a >> 1], b = kmp_op_arity((kmp_op)in->op) > 1 ? known[in->b >> 1] : ANY;
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
    number *known = KMP_NEW(number, leaves + p->code[p->stages]);
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
    for (int i = 0; w->s->force && w->mass && i < w->s->n; i++) /* C has generalized forces with their sign changed */
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
        kmp_machine_set(w->machine, KMP_IN_MODE, w->eval->mode);
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
    return !kmp_writer_machine_is_stale(w) && (w->eval->frozen || w->eval->system->events.count == 0);
}

/* SPDX-License-Identifier: BSD-3-Clause */
/* Dependencies of computed variables: by the arguments that the generated routines read. Coordinates follow from the
 * states through the closures, accelerations and multipliers from all that the routines of the motion read. */
#include "exchange/fmu/unit_structure.h"
#include "base/memory.h"
#include "exchange/fmu/unit_parts.h"
#include "exchange/simulator/kempe_fmu.h"
#include <string.h>

/* Level of a computed value: the deeper ones depend on more. */
typedef enum level { CONSTANT, PLACE, RATE, ACCELERATION } level;

struct kmp_unit_structure {
    const kmp_code_source *source;
    int inputs;        /* three each */
    bool *by_level[4]; /* inputs that the coordinates, rates, accelerations depend on */
    bool *read;        /* by the value at hand: inputs */
    bool *marked;      /* values of a program */
    const kmp_code_routine *show, *changes;
};

/* Marks the inputs that the outputs [first, first + count) of stage 1 are computed from, and returns their level. */
static level read_outputs(const struct kmp_unit_structure *s, const kmp_code_routine *r, int first, int count,
                          bool *inputs)
{
    const kmp_program *p = r->program;
    /* Conditions are decided by place and rate, or by more: see below. */
    static const level levels[KMP_IN_COUNT] = {[KMP_IN_Q] = PLACE,
                                               [KMP_IN_QD] = RATE,
                                               [KMP_IN_MODE] = RATE,
                                               [KMP_IN_QDD] = ACCELERATION,
                                               [KMP_IN_LAMBDA] = ACCELERATION};
    const int before = p->constant_count + p->input_count, all = before + p->code[p->stages];
    level deepest = CONSTANT;
    memset(s->marked, 0, (size_t)all * sizeof *s->marked);
    for (int k = 0; k < count; k++)
        s->marked[p->output[p->outputs[1] + first + k] >> 1] = true;
    for (int i = p->code[p->stages] - 1; i >= 0; i--)
        for (int k = 0; s->marked[before + i] && k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            s->marked[kmp_instruction_operand(&p->instruction[i], k) >> 1] = true;
    for (int k = 0; k < p->input_count; k++) {
        const kmp_program_input *in = &p->input[k];
        if (!s->marked[p->constant_count + k])
            continue;
        deepest = levels[in->kind] > deepest ? levels[in->kind] : deepest;
        if (in->kind == KMP_IN_TIME && in->index > 0 && (int)in->index <= s->inputs)
            inputs[in->index - 1] = true;
    }
    return deepest;
}

static int size_of(const kmp_code_routine *r)
{
    const kmp_program *p = r->program;
    return p->constant_count + p->input_count + p->code[p->stages];
}

/* Inputs of coordinates: the values that closures read; of rates: the derivatives, too; of accelerations: all. */
static void find_levels(struct kmp_unit_structure *s)
{
    static const char *const deep[] = {"motion", "loads", "changes"};
    const kmp_code_routine *closures = kmp_simulated_routine(s->source, "closures");
    bool *place = s->by_level[PLACE], *rate = s->by_level[RATE], *acceleration = s->by_level[ACCELERATION];
    if (closures)
        (void)read_outputs(s, closures, 0, closures->program->outputs[2] - closures->program->outputs[1], rate);
    for (int k = 0; k < s->inputs; k += 3) {
        place[k] = rate[k] = rate[k] || rate[k + 1]; /* h has the value, h_t its derivative */
        acceleration[k] = acceleration[k + 1] = acceleration[k + 2] = rate[k];
    }
    for (int k = 0; k < s->inputs; k++)
        acceleration[k] = acceleration[k] || rate[k];
    for (size_t i = 0; i < sizeof deep / sizeof *deep; i++) {
        const kmp_code_routine *r = kmp_simulated_routine(s->source, deep[i]);
        if (r)
            (void)read_outputs(s, r, 0, r->program->outputs[2] - r->program->outputs[1], acceleration);
    }
}

kmp_unit_structure *kmp_unit_structure_new(kmp_arena *arena, const kmp_code_source *source)
{
    kmp_unit_structure *s = KMP_ARENA_NEW(arena, kmp_unit_structure, 1);
    int most = 1;
    for (int k = 0; k < source->count; k++)
        most = size_of(&source->routines[k]) > most ? size_of(&source->routines[k]) : most;
    if (!s)
        return NULL;
    s->source = source;
    s->inputs = 3 * source->input_count;
    s->show = kmp_simulated_routine(source, "show");
    s->changes = kmp_simulated_routine(source, "changes");
    if (!KMP_ARENA_MAKE(arena,
                        KMP_ROOM(bool, s->inputs, &s->by_level[CONSTANT], &s->by_level[PLACE], &s->by_level[RATE],
                                 &s->by_level[ACCELERATION], &s->read),
                        KMP_ROOM(bool, most, &s->marked)))
        return NULL;
    find_levels(s);
    return s;
}

/* The level of a variable; the inputs that its own expression reads are marked. */
static level find_level(const kmp_unit_structure *s, int block, int at)
{
    const int f = s->source->simulated->freedom;
    switch (block) {
    case KEMPE_FMU_Q:
        return PLACE;
    case KEMPE_FMU_QD:
        return RATE;
    case KEMPE_FMU_STATES:
        return at < f ? PLACE : RATE;
    case KEMPE_FMU_RATES:
        return at < f ? RATE : ACCELERATION;
    case KEMPE_FMU_OUTPUTS:
        return s->show ? read_outputs(s, s->show, at, 1, s->read) : ACCELERATION;
    case KEMPE_FMU_CONDITIONS:
        return read_outputs(s, s->changes, at, 1, s->read);
    default:
        return ACCELERATION;
    }
}

bool kmp_unit_depends(const kmp_unit_structure *s, unsigned reference, unsigned known)
{
    const int block = (int)(reference / KEMPE_FMU_BLOCK), at = (int)(reference % KEMPE_FMU_BLOCK);
    const int known_block = (int)(known / KEMPE_FMU_BLOCK), known_at = (int)(known % KEMPE_FMU_BLOCK);
    memset(s->read, 0, (size_t)s->inputs * sizeof *s->read);
    const level deepest = find_level(s, block, at);
    if (known_block == KEMPE_FMU_STATES && block == KEMPE_FMU_RATES && at < s->source->simulated->freedom)
        return known_at == at + s->source->simulated->freedom;
    if (known_block == KEMPE_FMU_STATES)
        return deepest >= RATE || (deepest == PLACE && known_at < s->source->simulated->freedom);
    if (block == KEMPE_FMU_RATES && at < s->source->simulated->freedom)
        return false;
    return s->read[known_at] || s->by_level[deepest][known_at];
}

bool kmp_unit_has_dependencies(unsigned reference)
{
    const int block = (int)(reference / KEMPE_FMU_BLOCK);
    return (block >= KEMPE_FMU_STATES && block <= KEMPE_FMU_OUTPUTS) || block == KEMPE_FMU_CONDITIONS;
}

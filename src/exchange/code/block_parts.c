/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/code/block_parts.h"
#include "base/context.h"
#include "base/memory.h"
#include "symbolic/interpreter.h"

/* -- values by place ---------------------------------------------------------------------------------- */

/* True for constants, the place, and the instructions before i that depend only on these. */
static bool stands(const kmp_program *p, const bool *standing, uint32_t operand)
{
    const int value = (int)(operand >> 1), leaves = p->constant_count + p->input_count;
    if (value < p->constant_count)
        return true;
    if (value >= leaves)
        return standing[value - leaves];
    const kmp_program_input *in = &p->input[value - p->constant_count];
    return in->kind == KMP_IN_Q && in->index == 0;
}

/* q has room for the unknowns, of which those after the first are zero: no value depends on them. */
static bool evaluate_places(const kmp_program *p, double *q, int places, const double *place, const int *list,
                            kmp_place_values *values)
{
    const int leaves = p->constant_count + p->input_count;
    kmp_interpreter *code = kmp_interpreter_new(p);
    for (int at = 0; code && at < places; at++) {
        double *row = values->rows + (ptrdiff_t)at * values->width;
        q[0] = place[at];
        kmp_interpreter_set(code, KMP_IN_Q, q);
        for (int stage = 0; stage < p->stages; stage++)
            (void)kmp_interpreter_run(code, stage);
        row[0] = place[at];
        for (int k = 1; k < values->width; k++)
            row[k] = kmp_interpreter_values(code)[leaves + list[k - 1]];
    }
    kmp_interpreter_free(code);
    return code;
}

/* The program with such values as inputs, and their rows. NULL: no memory. */
static kmp_program *take_place_values(const kmp_program *p, int unknowns, kmp_arena *arena, int places,
                                      const double *place, kmp_place_values *values)
{
    const size_t code = (size_t)p->code[p->stages];
    bool *standing = KMP_NEW(bool, code + 1);
    int *list = KMP_NEW(int, code + 1), count = 0;
    double *q = KMP_NEW(double, unknowns);
    kmp_program *found = NULL;
    if (standing && list && q) {
        for (int i = 0; i < p->code[p->stages]; i++) {
            standing[i] = i >= p->code[1];
            for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
                standing[i] = standing[i] && stands(p, standing, kmp_instruction_operand(&p->instruction[i], k));
        }
        found = kmp_program_given(p, standing, unknowns, list, &count);
    }
    values->width = 1 + count;
    values->rows = KMP_ARENA_NEW(arena, double, (size_t)places *(size_t)values->width);
    if (found && !(values->rows && evaluate_places(p, q, places, place, list, values))) {
        kmp_program_free(found);
        found = NULL;
    }
    kmp_free(standing);
    kmp_free(list);
    kmp_free(q);
    return found;
}

/* -- parts of a block ---------------------------------------------------------------------------------- */

/* The program of only one stage's outputs: stage 0 for the arguments, stage 1 for all else. NULL: no memory. */
static kmp_program *stage_of(const kmp_program *p, int stage)
{
    const kmp_importing whole = {0};
    kmp_graph *g = kmp_graph_new();
    kmp_ref *out = KMP_NEW(kmp_ref, p->outputs[p->stages]);
    kmp_program *found = NULL;
    if (g && out && kmp_program_import(p, g, &whole, out)) {
        const kmp_ref *first = out + p->outputs[stage];
        const int count = p->outputs[stage + 1] - p->outputs[stage];
        found = kmp_program_of_parameters(g, count, first);
    }
    kmp_free(out);
    kmp_graph_free(g);
    return found;
}

const char *const kmp_block_part_names[KMP_BLOCK_PARTS] = {"guess", "merit", "scan", "equations"};

static bool make_part(kmp_code_source *source, const kmp_code_routine *routine, int block, kmp_block_part number)
{
    struct kmp_code_block *b = &routine->blocks[block];
    const kmp_program_block *whole = b->block;
    kmp_code_routine *part = &b->part[number];
    const bool among = whole->candidates > 0 && !whole->averages;
    /* Of the block's program; 0: the block lacks the part. */
    const int stages[KMP_BLOCK_PARTS] = {1, among ? 2 : 0, among ? 2 : 0, whole->program->stages - 1};
    if (stages[number] == 0)
        return true;
    part->inner = kmp_arena_printf(&source->arena, "%s_block%d_%s", routine->name, block, kmp_block_part_names[number]);
    if (!part->inner)
        return false;
    kmp_program *stage = stage_of(whole->program, stages[number]);
    if (stage && (whole->averages || number == KMP_PART_SCAN)) { /* it is evaluated only at the candidates */
        part->program = take_place_values(stage, whole->averages ? 1 : whole->unknowns, &source->arena,
                                          whole->candidates, whole->candidate, &b->rows[number]);
        kmp_program_free(stage);
    } else
        part->program = stage;
    part->arguments = 1u << KMP_IN_Q;
    part->array_count = 1;
    const int count = part->program ? part->program->outputs[2] - part->program->outputs[1] : 0;
    part->arrays[0] = (kmp_array){.name = "f", .meaning = "", .rows = count, .count = count};
    return part->program && kmp_code_find_kept(&source->arena, part);
}

kempe_status kmp_code_blocks_make(kmp_code_source *source, kmp_code_routine *routine)
{
    const kmp_program *p = routine->program;
    if (p->block_count == 0)
        return KEMPE_OK;
    routine->blocks = KMP_ARENA_NEW(&source->arena, struct kmp_code_block, p->block_count);
    bool ok = routine->blocks;
    for (int k = 0; ok && k < p->block_count; k++) {
        routine->blocks[k].block = &p->block[k];
        for (int part = 0; ok && part < KMP_BLOCK_PARTS; part++)
            ok = make_part(source, routine, k, (kmp_block_part)part);
    }
    return kmp_made(source->context, ok);
}

void kmp_code_blocks_free(kmp_code_routine *routine)
{
    for (int k = 0; routine->blocks && k < routine->program->block_count; k++)
        for (int part = 0; part < KMP_BLOCK_PARTS; part++)
            kmp_program_free(routine->blocks[k].part[part].program);
}

const kmp_program *kmp_code_next_program(const kmp_code_routine *routine, int *i)
{
    const int parts = routine->blocks ? routine->program->block_count * KMP_BLOCK_PARTS : 0;
    const kmp_program *found = NULL;
    for (; !found && *i <= parts; ++*i)
        found = *i == 0 || !routine->blocks
                    ? routine->program
                    : routine->blocks[(*i - 1) / KMP_BLOCK_PARTS].part[(*i - 1) % KMP_BLOCK_PARTS].program;
    return found;
}

bool kmp_code_block_source(const kmp_code_source *of, kmp_arena *arena, kmp_code_source *source)
{
    int most = 1;
    for (int k = 0; k < of->count; k++)
        for (int b = 0; b < of->routines[k].program->block_count; b++)
            if (of->routines[k].program->block[b].arguments > most)
                most = of->routines[k].program->block[b].arguments;
    *source = *of;
    source->parameters = true;
    source->legible = source->vectorised = false;
    source->place = KMP_ARENA_NEW(arena, int, most);
    for (int k = 0; source->place && k < most; k++)
        source->place[k] = k;
    return source->place;
}

/* -- lists --------------------------------------------------------------------------------------------- */

uint32_t kmp_code_block_item(const kmp_program *p, uint32_t list, int k)
{
    const int leaves = p->constant_count + p->input_count;
    for (int i = (int)(list >> 1) - leaves; i >= 0 && p->instruction[i].op == KMP_OP_LIST;
         i = (int)(list >> 1) - leaves) {
        if (k-- == 0)
            return p->instruction[i].a;
        list = p->instruction[i].b;
    }
    return UINT32_MAX;
}

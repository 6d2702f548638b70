/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/blocks/block_parts.h"
#include "base/context.h"
#include "base/memory.h"
#include <string.h>

/* -- parts of a block ---------------------------------------------------------------------------------- */

/* The program of one stage's outputs alone: stage 0 for the arguments, stage 1 for all else. NULL: no memory. */
static kmp_program *stage_of(const kmp_program *p, int stage)
{
    const kmp_importing whole = {0};
    kmp_graph *g = kmp_graph_new();
    kmp_ref *out = KMP_NEW(kmp_ref, p->outputs[p->stages]);
    kmp_program *found = NULL;
    if (g && out && kmp_program_import(p, g, &whole, out)) {
        const kmp_ref *first = out + p->outputs[stage];
        const int count = p->outputs[stage + 1] - p->outputs[stage];
        found = kmp_program_new(g, 1, &count, &first);
    }
    kmp_free(out);
    kmp_graph_free(g);
    return found;
}

/* For averages with rows of values by place. NULL: no memory. */
static kmp_program *part_of(const kmp_program_block *block, int stage, kmp_arena *arena, kmp_place_values *rows)
{
    kmp_program *whole = stage_of(block->program, stage);
    if (!whole || !block->averages)
        return whole;
    kmp_program *part = kmp_place_values_take(whole, arena, block->candidates, block->candidate, rows);
    kmp_program_free(whole);
    return part;
}

static bool make_part(kmp_code_source *source, kmp_code_routine *part, const kmp_code_routine *routine, int block,
                      const char *name, int stage, kmp_place_values *rows)
{
    const char *given = kmp_arena_printf(&source->arena, "%s_block%d_%s", routine->name, block, name);
    if (!given)
        return false;
    part->inner = given;
    part->program = part_of(&routine->program->block[block], stage, &source->arena, rows);
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
        struct kmp_code_block *b = &routine->blocks[k];
        b->block = &p->block[k];
        ok = make_part(source, &b->guess, routine, k, "guess", 1, &b->guess_rows) &&
             make_part(source, &b->equations, routine, k, "equations", b->block->program->stages - 1,
                       &b->equations_rows) &&
             (b->block->candidates == 0 || b->block->averages ||
              make_part(source, &b->merit, routine, k, "merit", 2, NULL));
    }
    return kmp_made(source->context, ok);
}

void kmp_code_blocks_free(kmp_code_routine *routine)
{
    for (int k = 0; routine->blocks && k < routine->program->block_count; k++) {
        kmp_program_free(routine->blocks[k].guess.program);
        kmp_program_free(routine->blocks[k].merit.program);
        kmp_program_free(routine->blocks[k].equations.program);
    }
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

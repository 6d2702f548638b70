/* SPDX-License-Identifier: BSD-3-Clause */
/* Slots and segments of a program. An instruction belongs to the first segment in which its operands are available; a
 * segment ends where sines, cosines or other functions are needed, which are then evaluated together. */
#include "backend/layout.h"
#include "backend/program_parts.h"
#include "base/thread_pool.h"
#include "symbolic/op_value.h"
#include "symbolic/solving.h"
#include "symbolic/table_function.h"
#include <string.h>

enum { LANES = 8 }; /* of sines and cosines */

static inline int layout_part(const kmp_layout *l, int instruction)
{
    return l->part ? l->part[instruction] : 0;
}

/* -- frames ---------------------------------------------------------------------------------------------- */

void kmp_frame_free(kmp_frame *f)
{
    for (uint32_t k = 0; f->solving && k < f->solving_count; k++)
        kmp_solving_free(f->solving[k]);
    for (uint32_t k = 0; f->room && k < f->room_count; k++)
        kmp_solving_free(f->room[k]);
    kmp_arena_free(&f->arena);
    kmp_arena_free(&f->values);
    *f = (kmp_frame){0};
}

bool kmp_frame_extend(kmp_frame *f, uint32_t slots)
{
    kmp_arena values = {0};
    double *v = slots > 0 ? kmp_arena_aligned(&values, f->slots + slots) : f->v;
    if (!v)
        return false;
    if (slots > 0) {
        memcpy(v, f->v, f->slots * sizeof *v);
        kmp_arena_free(&f->values);
        f->values = values;
    }
    f->v = v;
    f->slots += slots;
    return true;
}

static kmp_solving *new_solving(const kmp_frame *f, uint32_t block)
{
    return kmp_solving_new(&f->program->block[block], f->runner.run ? &f->runner : NULL);
}

/* Rooms of the blocks for each thread. A room for each list of arguments would do as well, but a room is large: many
 * do not fit in a cache. */
static bool add_rooms(kmp_frame *f)
{
    uint32_t blocks = (uint32_t)f->program->block_count, threads = (uint32_t)kmp_team_threads(f->team);
    f->room_count = blocks * threads;
    f->room = KMP_ARENA_NEW(&f->arena, kmp_solving *, f->room_count);
    bool ok = f->room;
    for (uint32_t k = 0; ok && k < f->solving_count; k++)
        for (uint32_t r = f->block_of[k]; ok && r < f->room_count; r += blocks) {
            f->room[r] = f->room[r] ? f->room[r] : new_solving(f, f->block_of[k]);
            ok = f->room[r];
        }
    return ok;
}

bool kmp_frame_add_blocks(kmp_frame *f)
{
    f->solving = KMP_ARENA_NEW(&f->arena, kmp_solving *, f->solving_count);
    bool ok = f->solving && (!f->team || add_rooms(f));
    for (uint32_t k = 0; ok && k < f->solving_count; k++) {
        /* A block with another list of arguments is in the room of an earlier one. */
        uint32_t block = f->block_of[k], same = 0;
        while (!f->room && same < k && f->block_of[same] != block)
            same++;
        f->solving[k] = f->room    ? kmp_solving_beside(f->room[block])
                        : same < k ? kmp_solving_beside(f->solving[same])
                                   : new_solving(f, block);
        ok = f->solving[k];
    }
    return ok;
}

void kmp_frame_set(void *code, kmp_input_kind kind, const double *values)
{
    const kmp_frame *f = code;
    const kmp_input_slot *feed = f->feeds + f->feed_start[kind], *end = f->feeds + f->feed_start[kind + 1];
    double *restrict v = f->v;
    for (; feed < end; feed++)
        v[feed->slot] = values[feed->index];
}

const double *kmp_frame_outputs(const void *code, int stage)
{
    const kmp_frame *f = code;
    return f->v + f->out + f->program->outputs[stage];
}

static void add_count(const kmp_frame *f, uint32_t block, const kmp_solving *solving, kmp_block_counts *counts)
{
    const kmp_counts of = kmp_solving_count(solving);
    kmp_counts_add(f->program->block[block].averages ? &counts->averages : &counts->equations, &of, 1);
}

void kmp_frame_count(const void *code, kmp_block_counts *counts)
{
    const kmp_frame *f = code;
    for (uint32_t k = 0; f->room && k < f->room_count; k++)
        if (f->room[k])
            add_count(f, k % (uint32_t)f->program->block_count, f->room[k], counts);
    for (uint32_t k = 0; f->solving && k < f->solving_count; k++) {
        const bool averages = f->program->block[f->block_of[k]].averages;
        add_count(f, f->block_of[k], f->solving[k], counts);
        *(averages ? &counts->average_lists : &counts->equation_lists) += kmp_solving_is_done(f->solving[k]);
    }
}

static double run_implicit(const kmp_frame *f, const kmp_special *s, const double *v, size_t width)
{
    const kmp_instruction *in = &f->program->instruction[s->instruction];
    kmp_solving *solving = f->solving[s->operand[1]];
    if (f->room)
        kmp_solving_move(solving, f->room[kmp_team_thread(f->team) * f->program->block_count + (int)in->b]);
    double *p = kmp_solving_arguments(solving);
    for (int l = 0; l < f->program->block[in->b].arguments; l++) {
        const kmp_list_item *a = &f->items[s->operand[0] + (uint32_t)l];
        p[l] = v[a->slot * width] * a->factor;
    }
    return kmp_solving_value(solving, (int)in->c);
}

/* Operands that an operation has not are the slot of 1. *piece is the piece of the last table, since several tables are
 * often looked up at one place. */
static inline __attribute__((always_inline)) void run_special(const kmp_frame *f, const kmp_special *s, double *v,
                                                              size_t width, int *piece)
{
    double x[3];
    if (s->op == KMP_OP_DIV) { /* has no signs */
        v[s->d * width] = v[s->operand[0] * width] / v[s->operand[1] * width];
        return;
    }
    if (s->op == KMP_OP_IMPLICIT) {
        v[s->d * width] = run_implicit(f, s, v, width);
        return;
    }
    x[0] = s->minus[0] ? -v[s->operand[0] * width] : v[s->operand[0] * width];
    if (s->op == KMP_OP_TABLE) {
        const kmp_instruction *in = &f->program->instruction[s->instruction];
        v[s->d * width] = kmp_table_value_near(f->program->table[in->b], (int)in->c, x[0], piece);
        return;
    }
    for (int k = 1; k < 3; k++)
        x[k] = s->minus[k] ? -v[s->operand[k] * width] : v[s->operand[k] * width];
    v[s->d * width] = kmp_op_value_here((kmp_op)s->op, x[0], x[1], x[2]);
}

void kmp_frame_special(const kmp_frame *f, const kmp_special *special, double *v, size_t width)
{
    int piece = 0;
    run_special(f, special, v, width, &piece);
}

void kmp_frame_specials(kmp_frame *f, uint32_t segment)
{
    const kmp_special *special = f->specials + f->segments[segment].special;
    const kmp_special *end = f->specials + f->segments[segment + 1].special;
    int own = 0, *piece = f->team ? &own : &f->piece; /* a frame of several threads is not written to */
    const kmp_solving *solved = NULL; /* of one list of arguments, which are the same within a segment */
    for (; special < end; special++) {
        const bool implicit = special->op == KMP_OP_IMPLICIT;
        if (implicit && f->solving[special->operand[1]] == solved)
            f->v[special->d] = kmp_solving_component(solved, (int)f->program->instruction[special->instruction].c);
        else
            run_special(f, special, f->v, 1, piece);
        solved = implicit ? f->solving[special->operand[1]] : solved;
    }
}

void kmp_frame_copies(kmp_frame *f, int stage)
{
    const kmp_copy *copy = f->copies + f->copy_start[stage], *end = f->copies + f->copy_start[stage + 1];
    double *v = f->v;
    for (; copy < end; copy++)
        v[copy->to] = v[copy->from] * copy->factor;
}

/* True for instructions that end a segment. Lists compute nothing: what reads them reads their items. */
static bool is_special(const kmp_layout *l, int i)
{
    return !l->is_straight[i] && l->program->instruction[i].op != KMP_OP_LIST;
}

static uint32_t depth_of(const kmp_layout *l, int i)
{
    const kmp_instruction *in = &l->program->instruction[i];
    uint32_t d = 0;
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
        /* Leaves and values of earlier stages and other parts are there from the first segment on. */
        const int of = kmp_layout_instruction(l, kmp_instruction_operand(in, k));
        const bool here = of >= 0 && l->stage_of[of] >= l->stage_of[i] && layout_part(l, of) == layout_part(l, i);
        d = here && l->depth[of] > d ? l->depth[of] : d;
    }
    return d + is_special(l, i);
}

/* Puts the parts of a stage one after another, each with separate segments: depths within parts become depths within
 * the stage. */
static void line_up(kmp_layout *l, int stage)
{
    const int *code = l->program->code;
    uint32_t *first = l->frame->part_first + l->frame->part_start[stage];
    int parts = kmp_frame_parts(l->frame, stage);
    for (int i = code[stage]; i < code[stage + 1]; i++) {
        uint32_t *segments = &first[l->part[i] + 1];
        *segments = l->depth[i] + 1 > *segments ? l->depth[i] + 1 : *segments;
    }
    for (int k = 0; k < parts + 2; k++)
        first[k + 1] += first[k];
    for (int i = code[stage]; i < code[stage + 1]; i++)
        l->depth[i] += first[l->part[i]];
}

static bool analyse(kmp_layout *l, bool (*straight)(const kmp_instruction *in))
{
    const kmp_program *p = l->program;
    for (int i = 0; i < p->code[p->stages]; i++) {
        l->is_straight[i] = straight(&p->instruction[i]);
        l->special_count += is_special(l, i);
    }
    for (int s = 0; s < p->stages; s++)
        for (int i = p->code[s]; i < p->code[s + 1]; i++)
            l->stage_of[i] = (uint16_t)s;
    for (int s = 0; s < p->stages; s++) {
        if (l->frame->threads > 0) {
            uint32_t *start = l->frame->part_start + s;
            int parts = kmp_parts_find(l, s, l->frame->threads);
            start[1] = start[0] + (parts > 0 ? (uint32_t)parts + 3 : 0);
            if (parts < 0)
                return false;
        }
        for (int i = p->code[s]; i < p->code[s + 1]; i++)
            l->depth[i] = depth_of(l, i);
        if (kmp_frame_parts(l->frame, s) > 0)
            line_up(l, s);
    }
    return true;
}

static bool is_angle(const kmp_layout *l, int i)
{
    return l->program->instruction[i].op == KMP_OP_SIN || l->program->instruction[i].op == KMP_OP_COS;
}

/* Adds an angle; its sine and cosine have their slots in groups of eight. */
static void add_angle(kmp_layout *l, uint32_t x)
{
    kmp_frame *f = l->frame;
    uint32_t k = f->angles++;
    f->angle[k] = x;
    f->sine[k] = l->lanes + 2 * LANES * (k / LANES) + k % LANES;
    f->cosine[k] = f->sine[k] + LANES;
}

/* Sine and cosine of one angle in one segment share an entry. */
static void write_angle(kmp_layout *l, int i, uint32_t first)
{
    kmp_frame *f = l->frame;
    const kmp_instruction *in = &l->program->instruction[i];
    uint32_t x = kmp_layout_slot(l, in->a), k = l->angle_of[x];
    if (k < first || k >= f->angles || f->angle[k] != x) { /* not yet in this segment */
        k = f->angles;
        l->angle_of[x] = k;
        add_angle(l, x);
    }
    l->slot[l->leaves + i] = in->op == KMP_OP_SIN ? f->sine[k] : f->cosine[k];
}

/* The items of the list that an implicit instruction reads. */
static void write_arguments(kmp_layout *l, kmp_special *s, const kmp_instruction *in)
{
    kmp_frame *f = l->frame;
    uint32_t list = in->a;
    s->operand[0] = f->item_count;
    for (int k = 0; k < l->program->block[in->b].arguments; k++) {
        const kmp_instruction *item = &l->program->instruction[kmp_layout_instruction(l, list)];
        f->items[f->item_count++] = (kmp_list_item){kmp_layout_slot(l, item->a), item->a & 1 ? -1 : 1};
        list = item->b;
    }
}

static void write_special(kmp_layout *l, int i, uint32_t first_angle)
{
    const kmp_instruction *in = &l->program->instruction[i];
    if (is_angle(l, i)) {
        write_angle(l, i, first_angle);
        return;
    }
    kmp_special *s = &l->frame->specials[l->frame->special_count++];
    *s = (kmp_special){.op = in->op, .instruction = (uint32_t)i, .d = kmp_layout_target(l, i)};
    if (in->op == KMP_OP_IMPLICIT) {
        write_arguments(l, s, in);
        s->operand[1] = l->solving_of[i];
        return;
    }
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
        s->operand[k] = kmp_layout_slot(l, kmp_instruction_operand(in, k));
        s->minus[k] = kmp_instruction_operand(in, k) & 1;
    }
}

static uint32_t deepest(const kmp_layout *l, int stage)
{
    uint32_t d = 0;
    for (int i = l->program->code[stage]; i < l->program->code[stage + 1]; i++)
        d = l->depth[i] > d ? l->depth[i] : d;
    return d;
}

/* Segment of the stage that an instruction is written in. */
static uint32_t segment_of(const kmp_layout *l, int i)
{
    return l->depth[i] - is_special(l, i);
}

static void write_segment(kmp_layout *l, uint32_t begin, uint32_t end)
{
    kmp_frame *f = l->frame;
    uint32_t first_angle = f->angles;
    l->segment_start[f->segment_count] = begin;
    kmp_segment *segment = &f->segments[f->segment_count++];
    *segment = (kmp_segment){.angle = first_angle, .special = f->special_count};
    for (uint32_t k = begin; k < end; k++)
        if (is_special(l, l->order[k]))
            write_special(l, l->order[k], first_angle);
    segment->angles = f->angles - first_angle;
    while (f->angles % LANES != 0)
        add_angle(l, KMP_SLOT_ONE);
}

/* Writes the segments, and the special functions of each. */
static bool write_segments(kmp_layout *l)
{
    kmp_frame *f = l->frame;
    const kmp_program *p = l->program;
    uint32_t most = 0;
    for (int s = 0; s < p->stages; s++)
        most = deepest(l, s) > most ? deepest(l, s) : most;
    uint32_t *first = KMP_ARENA_NEW(&l->arena, uint32_t, most + 2);
    for (int s = 0; first && s < p->stages; s++) {
        uint32_t segments = deepest(l, s) + 1, begin = (uint32_t)p->code[s];
        f->stage[s] = f->segment_count;
        /* The instructions of a stage by segment, each segment's in the program's order; `first` is where each
         * begins. */
        const int *code = l->program->code;
        memset(first, 0, (segments + 1) * sizeof *first);
        for (int i = code[s]; i < code[s + 1]; i++)
            first[segment_of(l, i) + 1]++;
        for (uint32_t g = 0; g < segments; g++)
            first[g + 1] += first[g];
        for (int i = code[s]; i < code[s + 1]; i++)
            l->order[(uint32_t)code[s] + first[segment_of(l, i)]++] = i;
        for (uint32_t k = 0; k < segments; k++) { /* first has moved on to where each ends */
            write_segment(l, begin, (uint32_t)p->code[s] + first[k]);
            begin = (uint32_t)p->code[s] + first[k];
        }
    }
    f->stage[p->stages] = f->segment_count;
    f->segments[f->segment_count] = (kmp_segment){.angle = f->angles, .special = f->special_count};
    l->segment_start[f->segment_count] = (uint32_t)p->code[p->stages];
    return first;
}

void kmp_layout_visit(const kmp_layout *l, kmp_layout_write *write, void *self, const uint32_t *count, uint32_t *start)
{
    uint32_t segments = l->frame->segment_count;
    for (uint32_t g = 0; g < segments; g++) {
        start[g] = *count;
        for (uint32_t k = l->segment_start[g]; k < l->segment_start[g + 1]; k++)
            if (l->is_straight[l->order[k]] && kmp_layout_contraction(l, l->order[k]) != KMP_CONTRACTED)
                write(self, l->order[k]);
    }
    start[segments] = *count;
}

/* Unknowns of one block for one list of arguments are solved together. */
static void place_block(kmp_layout *l, int i, const kmp_instruction **first)
{
    kmp_frame *f = l->frame;
    const kmp_instruction *in = &l->program->instruction[i];
    uint32_t k = 0;
    while (k < f->solving_count && (first[k]->a != in->a || first[k]->b != in->b))
        k++;
    l->solving_of[i] = k;
    if (k < f->solving_count)
        return;
    f->block_of[k] = in->b;
    first[f->solving_count++] = in;
}

static bool list_blocks(kmp_layout *l)
{
    kmp_frame *f = l->frame;
    const kmp_program *p = l->program;
    size_t count = 0, items = 0;
    for (int i = 0; i < p->code[p->stages]; i++)
        if (p->instruction[i].op == KMP_OP_IMPLICIT) {
            count++;
            items += (size_t)p->block[p->instruction[i].b].arguments;
        }
    f->items = KMP_ARENA_NEW(&f->arena, kmp_list_item, items);
    f->block_of = KMP_ARENA_NEW(&f->arena, uint32_t, count);
    l->solving_of = count > 0 ? KMP_ARENA_NEW(&l->arena, uint32_t, p->code[p->stages]) : NULL;
    const kmp_instruction **first = KMP_ARENA_NEW(&l->arena, const kmp_instruction *, count); /* of each solving */
    bool ok = !f->arena.failed && !l->arena.failed;
    for (int i = 0; ok && i < p->code[p->stages]; i++)
        if (p->instruction[i].op == KMP_OP_IMPLICIT)
            place_block(l, i, first);
    return ok;
}

static bool allocate(kmp_layout *l, uint32_t extra)
{
    kmp_frame *f = l->frame;
    kmp_arena *a = &f->arena;
    const kmp_program *p = l->program;
    uint32_t code = (uint32_t)p->code[p->stages], outputs = (uint32_t)p->outputs[p->stages];
    uint32_t segments = 1, of_angles = 0; /* with the end; instructions */
    for (int s = 0; s < p->stages; s++)
        segments += deepest(l, s) + 1;
    for (int i = 0; i < p->code[p->stages]; i++)
        of_angles += is_angle(l, i);
    /* With the instructions that fill the groups of eight in segments that have some. */
    const uint32_t angles = of_angles + (LANES - 1) * (segments < of_angles ? segments : of_angles);
    l->lanes = KMP_FIRST_SLOT + (uint32_t)l->leaves + code + outputs;
    l->lanes += (LANES - l->lanes % LANES) % LANES;
    f->slots = l->lanes + 2 * angles;
    f->v =
        kmp_arena_aligned(&f->values, f->slots + extra); /* eight doubles that are stored together are not torn apart */
    KMP_ARENA_MAKE(a, KMP_ROOM(kmp_special, l->special_count, &f->specials),
                   KMP_ROOM(uint32_t, angles, &f->angle, &f->sine, &f->cosine),
                   KMP_ROOM(kmp_segment, segments, &f->segments),
                   KMP_ROOM(uint32_t, p->stages + 1, &f->stage, &f->copy_start),
                   KMP_ROOM(kmp_copy, outputs, &f->copies), KMP_ROOM(kmp_input_slot, p->input_count, &f->feeds));
    l->segment_start = KMP_ARENA_NEW(&l->arena, uint32_t, segments);
    l->angle_of = angles > 0 ? KMP_ARENA_NEW(&l->arena, uint32_t, f->slots) : NULL;
    return f->v && !a->failed && !l->arena.failed;
}

/* Gives every value its slot, except sines and cosines, which get theirs when segments are written. An instruction that
 * is an output of its stage computes straight into its place among the outputs. An output that is a constant has
 * its value there from the beginning. The others are copied at the end of the stage. */
static void place_values(kmp_layout *l)
{
    kmp_frame *f = l->frame;
    const kmp_program *p = l->program;
    uint32_t values = (uint32_t)(l->leaves + p->code[p->stages]), first = KMP_FIRST_SLOT + values, copies = 0;
    f->out = first;
    for (uint32_t k = 0; k < values; k++)
        l->slot[k] = KMP_FIRST_SLOT + k;
    for (int s = 0; s < p->stages; s++) {
        f->copy_start[s] = copies;
        for (int k = p->outputs[s]; k < p->outputs[s + 1]; k++) {
            uint32_t value = p->output[k] >> 1, to = first + (uint32_t)k;
            int i = kmp_layout_instruction(l, p->output[k]);
            if (value < (uint32_t)p->constant_count)
                f->v[to] = p->output[k] & 1 ? -p->constant[value] : p->constant[value];
            else if (i >= 0 && !(p->output[k] & 1) && l->stage_of[i] == s && l->slot[value] < first && !is_angle(l, i))
                l->slot[value] = to;
            else
                f->copies[copies++] = (kmp_copy){value, to, p->output[k] & 1 ? -1 : 1};
        }
    }
    f->copy_start[p->stages] = copies;
}

void kmp_layout_free(kmp_layout *l)
{
    kmp_arena_free(&l->arena);
    *l = (kmp_layout){0};
}

static bool begin(kmp_layout *l)
{
    int code = l->program->code[l->program->stages];
    kmp_arena *a = &l->arena;
    KMP_ARENA_MAKE(a, KMP_ROOM(uint32_t, code, &l->depth), KMP_ROOM(uint16_t, code, &l->stage_of),
                   KMP_ROOM(uint32_t, l->leaves + code, &l->slot), KMP_ROOM(bool, code, &l->is_straight),
                   KMP_ROOM(int, code, &l->order));
    l->contraction = l->program->contraction;
    if (l->frame->threads > 0) {
        int stages = l->program->stages;
        l->part = KMP_ARENA_NEW(a, uint8_t, code);
        l->frame->part_start = KMP_ARENA_NEW(&l->frame->arena, uint32_t, stages + 1);
        l->frame->part_first = KMP_ARENA_NEW(&l->frame->arena, uint32_t, stages * (KMP_PARTS_MOST + 3));
    }
    return !a->failed && !l->frame->arena.failed;
}

kmp_block_runner kmp_layout_runner(const kmp_backend *backend)
{
    return (kmp_block_runner){backend->prepare, backend->release, backend->set,
                              backend->run,     backend->outputs, backend->native};
}

bool kmp_layout_init(kmp_layout *l, kmp_frame *frame, const kmp_program *program,
                     bool (*straight)(const kmp_instruction *in), uint32_t extra, const kmp_backend *blocks,
                     int threads)
{
    *frame = (kmp_frame){.program = program, .threads = threads};
    if (blocks)
        frame->runner = kmp_layout_runner(blocks);
    *l = (kmp_layout){.frame = frame, .program = program, .leaves = program->constant_count + program->input_count};
    if (!begin(l) || !analyse(l, straight) || !allocate(l, extra) || !list_blocks(l))
        return false;
    place_values(l);
    /* Inputs by kind. */
    int count = 0;
    for (int kind = 0; kind < KMP_IN_COUNT; kind++) {
        frame->feed_start[kind] = count;
        for (int k = 0; k < program->input_count; k++)
            if ((int)program->input[k].kind == kind)
                frame->feeds[count++] = (kmp_input_slot){l->slot[program->constant_count + k], program->input[k].index};
    }
    frame->feed_start[KMP_IN_COUNT] = count;
    frame->v[KMP_SLOT_ONE] = 1;
    frame->v[KMP_SLOT_MINUS_ONE] = -1;
    frame->v[KMP_SLOT_MINUS_ZERO] = -0.0;
    if (program->constant_count > 0)
        memcpy(frame->v + KMP_FIRST_SLOT, program->constant, (size_t)program->constant_count * sizeof(double));
    if (!write_segments(l))
        return false;
    /* Once all values have their slots. */
    kmp_frame *f = l->frame;
    for (uint32_t k = 0; k < f->copy_start[l->program->stages]; k++)
        f->copies[k].from = l->slot[f->copies[k].from];
    return true;
}

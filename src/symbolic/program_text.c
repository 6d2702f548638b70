/* SPDX-License-Identifier: BSD-3-Clause */
/* The text of a program: docs/program_format.md. */
#include "symbolic/program.h"
#include "symbolic/table_function.h"
#include <math.h>

static const char *const input_words[KMP_IN_COUNT] = {"p",    "t",     "q",     "qd",    "qdd",    "lambda", "mu",
                                                      "mode", "place", "chart", "force", "torque", "effort", "along"};

static void print_operand(const kmp_program *p, uint32_t operand_, kmp_text *text)
{
    int value = (int)(operand_ >> 1);
    kmp_text_put(text, operand_ & 1 ? "-" : "");
    if (value < p->constant_count) {
        double x = p->constant[value];
        if (isfinite(x))
            kmp_text_number(text, x);
        else
            kmp_text_put(text, isnan(x) ? "nan" : x < 0 ? "-inf" : "inf");
    } else if (value < p->constant_count + p->input_count) {
        const kmp_program_input *in = &p->input[value - p->constant_count];
        if (in->kind == KMP_IN_TIME && in->index == 0)
            kmp_text_put(text, "t");
        else
            kmp_text_printf(text, "%s[%u]", input_words[in->kind], in->index);
    } else {
        kmp_text_printf(text, "v%d", value - p->constant_count - p->input_count);
    }
}

static void print_instruction(const kmp_program *p, int i, kmp_text *text)
{
    const kmp_instruction *in = &p->instruction[i];
    kmp_text_printf(text, "    v%d = ", i);
    if (kmp_op_form_of((kmp_op)in->op) == KMP_FORM_INFIX) {
        print_operand(p, in->a, text);
        bool minus = in->op == KMP_OP_ADD && (in->b & 1);
        kmp_text_printf(text, " %s ", minus ? "-" : kmp_op_text((kmp_op)in->op));
        print_operand(p, minus ? in->b ^ 1 : in->b, text);
    } else {
        kmp_text_put(text, kmp_op_text((kmp_op)in->op));
        if (kmp_op_form_of((kmp_op)in->op) == KMP_FORM_APPLIED)
            kmp_text_printf(text, "[%u, %u]", in->b, in->c);
        for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
            kmp_text_put(text, k ? ", " : "(");
            print_operand(p, kmp_instruction_operand(in, k), text);
        }
        kmp_text_put(text, ")");
    }
    kmp_text_put(text, "\n");
}

static void print_table(const kmp_table *table, int number, kmp_text *text)
{
    kmp_text_printf(text, "table %d %s\n", number, kmp_table_method_name(table->method));
    for (int k = 0; k < table->count; k++) {
        kmp_text_put(text, "    ");
        kmp_text_number(text, table->x[k]);
        kmp_text_put(text, " ");
        kmp_text_number(text, table->y[k]);
        kmp_text_put(text, "\n");
    }
}

void kmp_program_print(const kmp_program *p, const char *const *stage_name, kmp_text *text)
{
    kmp_text_put(text, "program 1\n");
    for (int k = 0; k < p->table_count; k++)
        print_table(p->table[k], k, text);
    for (int k = 0; k < p->block_count; k++) {
        kmp_text_printf(text, "implicit %d %s %d arguments %d\n", k, p->block[k].averages ? "averages" : "unknowns",
                        p->block[k].unknowns, p->block[k].arguments);
        const kmp_program_block *block = &p->block[k];
        for (int j = 0; j < block->candidates; j++) {
            kmp_text_put(text, "    ");
            kmp_text_number(text, block->candidate[j]);
            kmp_text_put(text, "\n");
        }
        kmp_program_print(p->block[k].program, NULL, text);
    }
    for (int s = 0; s < p->stages; s++) {
        kmp_text_printf(text, "stage %d%s%s\n", s, stage_name ? " " : "", stage_name ? stage_name[s] : "");
        for (int i = p->code[s]; i < p->code[s + 1]; i++)
            print_instruction(p, i, text);
        for (int k = p->outputs[s]; k < p->outputs[s + 1]; k++) {
            kmp_text_printf(text, "    out[%d] = ", k - p->outputs[s]);
            print_operand(p, p->output[k], text);
            kmp_text_put(text, "\n");
        }
    }
    kmp_text_put(text, "end\n");
}

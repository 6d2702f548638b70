/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation at one state from arrays as they are, for programs that repeat it. A call through cffi makes an object for
 * each array; here an array costs a look at its buffer. The module kempe._calls is in the file of kempe._native. Its
 * functions have the names of the functions in C, take the address of a workspace, n and m, and return the status,
 * CONVERT where an argument is not a contiguous array of float64 of the right length, or BUSY where another call is
 * inside the workspace. */
#define Py_LIMITED_API 0x030b0000
#include <Python.h>
#include <kempe/derivatives.h>
#include <stdbool.h>
#include <string.h>

enum { MOST_ARRAYS = 5, CONVERT = 1000, BUSY = 1001 };

/* A call that is inside a workspace. The list is changed only under the lock of the interpreter. */
typedef struct user {
    kempe_workspace *workspace;
    struct user *next;
} user;

static user *users;

static bool enter(user *new, kempe_workspace *workspace)
{
    for (const user *other = users; other; other = other->next)
        if (other->workspace == workspace)
            return false;
    *new = (user){workspace, users};
    users = new;
    return true;
}

static user *leave(const kempe_workspace *workspace)
{
    user **at = &users, *found;
    while (*at && (*at)->workspace != workspace)
        at = &(*at)->next;
    found = *at;
    if (found)
        *at = found->next;
    return found;
}

typedef struct python_call {
    PyObject *const *next; /* arguments that are still to be read */
    kempe_workspace *workspace;
    Py_ssize_t n, m;
    double t;
    Py_buffer views[MOST_ARRAYS];
    int count;
    bool plain; /* all arrays so far can be used as they are */
    bool busy;  /* another thread is inside the workspace */
    user user;
} python_call;

/* Reads workspace, n, m and t; false: Python has an exception. */
static bool begin(python_call *call, PyObject *const *arguments, Py_ssize_t given, Py_ssize_t arrays)
{
    call->next = arguments + 4;
    call->count = 0;
    call->plain = true;
    call->busy = false;
    if (given != 4 + arrays) {
        PyErr_SetString(PyExc_TypeError, "workspace, n, m, t and arrays are needed");
        return false;
    }
    call->workspace = PyLong_AsVoidPtr(arguments[0]);
    call->n = PyLong_AsSsize_t(arguments[1]);
    call->m = PyLong_AsSsize_t(arguments[2]);
    call->t = PyFloat_AsDouble(arguments[3]);
    if (PyErr_ExceptionMatches(PyExc_TypeError))
        PyErr_Format(PyExc_TypeError, "t is a number in SI, not %R", arguments[3]);
    return !PyErr_Occurred();
}

/* True if the call may be made, by which it is inside. */
static bool begins(python_call *call)
{
    call->busy = call->plain && !enter(&call->user, call->workspace);
    return call->plain && !call->busy;
}

/* False for a masked array, whose buffer has numbers where it has none. The last type without masks is kept. */
static bool has_all_numbers(PyObject *array)
{
    static PyObject *known;
    PyObject *type = (PyObject *)Py_TYPE(array);
    if (type == known)
        return true;
    if (PyObject_HasAttrString(type, "filled"))
        return false;
    Py_INCREF(type);
    Py_XDECREF(known);
    known = type;
    return true;
}

/* The next array, of `count` numbers; NULL for None. */
static double *doubles(python_call *call, Py_ssize_t count, int writable)
{
    PyObject *array = *call->next++;
    Py_buffer *view = call->views + call->count;
    if (array == Py_None)
        return NULL;
    if (!has_all_numbers(array) || PyObject_GetBuffer(array, view, PyBUF_ND | PyBUF_FORMAT | writable)) {
        PyErr_Clear();
        call->plain = false;
        return NULL;
    }
    call->count++;
    call->plain &= view->ndim == 1 && view->shape[0] == count && view->format && !strcmp(view->format, "d");
    return view->buf;
}

static PyObject *end(python_call *call, int status)
{
    while (call->count)
        PyBuffer_Release(call->views + --call->count);
    if (call->plain && !call->busy)
        (void)leave(call->workspace);
    return PyLong_FromLong(call->busy ? BUSY : call->plain ? status : CONVERT);
}

/* (t, q, qd) */
static PyObject *evaluate(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    (void)module;
    python_call call;
    if (!begin(&call, arguments, given, 2))
        return NULL;
    kempe_status status = KEMPE_OK;
    const double *q = doubles(&call, call.n, 0), *qd = doubles(&call, call.n, 0);
    if (begins(&call)) {
        Py_BEGIN_ALLOW_THREADS status = kempe_workspace_evaluate(call.workspace, call.t, q, qd);
        Py_END_ALLOW_THREADS
    }
    return end(&call, status);
}

/* (t, q, qd, Q or None; qdd, lam) */
static PyObject *forward_dynamics(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    (void)module;
    python_call call;
    if (!begin(&call, arguments, given, 5))
        return NULL;
    kempe_status status = KEMPE_OK;
    const double *q = doubles(&call, call.n, 0), *qd = doubles(&call, call.n, 0), *Q = doubles(&call, call.n, 0);
    double *qdd = doubles(&call, call.n, PyBUF_WRITABLE), *lam = doubles(&call, call.m, PyBUF_WRITABLE);
    if (begins(&call)) {
        Py_BEGIN_ALLOW_THREADS status = kempe_workspace_forward_dynamics(call.workspace, call.t, q, qd, Q, qdd, lam);
        Py_END_ALLOW_THREADS
    }
    return end(&call, status);
}

/* (t, q, qd, qdd; Q) */
static PyObject *inverse_dynamics(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    (void)module;
    python_call call;
    if (!begin(&call, arguments, given, 4))
        return NULL;
    kempe_status status = KEMPE_OK;
    const double *q = doubles(&call, call.n, 0), *qd = doubles(&call, call.n, 0), *qdd = doubles(&call, call.n, 0);
    double *Q = doubles(&call, call.n, PyBUF_WRITABLE);
    if (begins(&call)) {
        Py_BEGIN_ALLOW_THREADS status = kempe_workspace_inverse_dynamics(call.workspace, call.t, q, qd, qdd, Q);
        Py_END_ALLOW_THREADS
    }
    return end(&call, status);
}

/* The next `count` numbers of an answer; NULL: there is none. */
static double *part(double **answer, Py_ssize_t count)
{
    double *here = *answer;
    *answer = here ? here + count : NULL;
    return here;
}

/* (t, q, qd, Q or None; answer, closed): qdd, lam and the derivatives by all coordinates one after another in `answer`,
 * or by the independent ones in `closed`, in the order of kempe_workspace_derivatives; the other of them is None. */
static PyObject *forward_derivatives(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    (void)module;
    python_call call;
    if (!begin(&call, arguments, given, 5))
        return NULL;
    kempe_status status = KEMPE_OK;
    const Py_ssize_t n = call.n, m = call.m, p = kempe_workspace_independent_count(call.workspace);
    const Py_ssize_t names = kempe_workspace_name_count(call.workspace),
                     l = kempe_workspace_output_count(call.workspace);
    const double *q = doubles(&call, n, 0), *qd = doubles(&call, n, 0), *Q = doubles(&call, n, 0);
    double *all = doubles(&call, n + m + l + (3 * n + names) * (n + m + l), PyBUF_WRITABLE);
    double *closed =
        doubles(&call, n + m + l + 2 * p * p + 3 * n * p + names * (p + 2 * n) + l * (2 * p + names), PyBUF_WRITABLE);
    double **answer = all ? &all : &closed, *qdd = part(answer, n), *lam = part(answer, m);
    kempe_workspace_derivatives out;
    out.qdd_q = part(&all, n * n), out.qdd_qd = part(&all, n * n), out.qdd_Q = part(&all, n * n);
    out.lambda_q = part(&all, m * n), out.lambda_qd = part(&all, m * n), out.lambda_Q = part(&all, m * n);
    out.qdd_p = part(&all, n * names), out.lambda_p = part(&all, m * names);
    out.udd_u = part(&closed, p * p), out.udd_ud = part(&closed, p * p), out.udd_Q = part(&closed, p * n);
    out.q_u = part(&closed, n * p), out.qd_u = part(&closed, n * p);
    out.udd_p = part(&closed, p * names), out.q_p = part(&closed, n * names), out.qd_p = part(&closed, n * names);
    out.y = part(answer, l);
    out.y_q = part(&all, l * n), out.y_qd = part(&all, l * n), out.y_Q = part(&all, l * n);
    out.y_p = part(&all, l * names);
    out.y_u = part(&closed, l * p), out.y_ud = part(&closed, l * p), out.y_up = part(&closed, l * names);
    if (begins(&call)) {
        Py_BEGIN_ALLOW_THREADS status =
            kempe_workspace_forward_derivatives(call.workspace, call.t, q, qd, Q, qdd, lam, &out);
        Py_END_ALLOW_THREADS
    }
    return end(&call, status);
}

/* (workspace): true if no other call is inside, and the caller is now, until kempe._calls.leave. */
static PyObject *enter_workspace(PyObject *module, PyObject *workspace)
{
    (void)module;
    kempe_workspace *address = PyLong_AsVoidPtr(workspace);
    user *new = PyErr_Occurred() ? NULL : PyMem_Malloc(sizeof *new);
    if (!new)
        return PyErr_Occurred() ? NULL : PyErr_NoMemory();
    const bool entered = enter(new, address);
    if (!entered)
        PyMem_Free(new);
    return PyBool_FromLong(entered);
}

static PyObject *leave_workspace(PyObject *module, PyObject *workspace)
{
    (void)module;
    PyMem_Free(leave(PyLong_AsVoidPtr(workspace)));
    Py_RETURN_NONE;
}

#define ROW(name, function)                                                                                            \
    {                                                                                                                  \
        name, (PyCFunction)(void (*)(void))function, METH_FASTCALL, NULL                                               \
    }

static PyMethodDef methods[] = {
    ROW("kempe_workspace_evaluate", evaluate),
    ROW("kempe_workspace_forward_dynamics", forward_dynamics),
    ROW("kempe_workspace_inverse_dynamics", inverse_dynamics),
    ROW("kempe_workspace_forward_derivatives", forward_derivatives),
    {"enter", enter_workspace, METH_O, NULL},
    {"leave", leave_workspace, METH_O, NULL},
    {NULL, NULL, 0, NULL},
};

static PyModuleDef definition = {PyModuleDef_HEAD_INIT, "_calls", NULL, -1, methods, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__calls(void)
{
    PyObject *module = PyModule_Create(&definition);
    if (module) {
        PyModule_AddIntConstant(module, "CONVERT", CONVERT);
        PyModule_AddIntConstant(module, "BUSY", BUSY);
    }
    return module;
}

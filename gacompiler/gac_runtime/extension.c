/* Fast calls from Python to kernels: on one element, on a batch, with loops, and by the operators of values.

   One extension is shared by all generated modules of a folder. It contains no kernels: modules pass it the addresses
   of theirs. Arguments that it does not support (other dtypes, shapes, memory orders, wrong arguments) are passed to
   the Python code of the module, which converts them or reports the error. */

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <structmember.h>
#include <stddef.h>
#include <stdint.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#define MAX_ARRAYS 16
#define MAX_AXES 3
#define MAX_LEADING 8

typedef void (*Function)(void);

/* Calls a kernel, which takes every array as a pointer and every number by value. */
typedef void (*Invoke)(Function function, double *const *arrays, const double *numbers);

/* Calls through a pointer of the right type, for every order of at most four arrays (a) and numbers (n) before one or
   two results (r), since C has no calls whose parameters are known only at run time. Kernels with more parameters run
   single elements through their loop. */
#define IN const double *
#define NUMBER double
#define OUT double *
#define INVOKERS(INVOKER)                                                                       \
    INVOKER(ar, (IN, OUT), (a[0], a[1]))                                                        \
    INVOKER(arr, (IN, OUT, OUT), (a[0], a[1], a[2]))                                            \
    INVOKER(nr, (NUMBER, OUT), (n[0], a[0]))                                                    \
    INVOKER(nrr, (NUMBER, OUT, OUT), (n[0], a[0], a[1]))                                        \
    INVOKER(aar, (IN, IN, OUT), (a[0], a[1], a[2]))                                             \
    INVOKER(aarr, (IN, IN, OUT, OUT), (a[0], a[1], a[2], a[3]))                                 \
    INVOKER(anr, (IN, NUMBER, OUT), (a[0], n[0], a[1]))                                         \
    INVOKER(anrr, (IN, NUMBER, OUT, OUT), (a[0], n[0], a[1], a[2]))                             \
    INVOKER(nar, (NUMBER, IN, OUT), (n[0], a[0], a[1]))                                         \
    INVOKER(narr, (NUMBER, IN, OUT, OUT), (n[0], a[0], a[1], a[2]))                             \
    INVOKER(nnr, (NUMBER, NUMBER, OUT), (n[0], n[1], a[0]))                                     \
    INVOKER(nnrr, (NUMBER, NUMBER, OUT, OUT), (n[0], n[1], a[0], a[1]))                         \
    INVOKER(aaar, (IN, IN, IN, OUT), (a[0], a[1], a[2], a[3]))                                  \
    INVOKER(aaarr, (IN, IN, IN, OUT, OUT), (a[0], a[1], a[2], a[3], a[4]))                      \
    INVOKER(aanr, (IN, IN, NUMBER, OUT), (a[0], a[1], n[0], a[2]))                              \
    INVOKER(aanrr, (IN, IN, NUMBER, OUT, OUT), (a[0], a[1], n[0], a[2], a[3]))                  \
    INVOKER(anar, (IN, NUMBER, IN, OUT), (a[0], n[0], a[1], a[2]))                              \
    INVOKER(anarr, (IN, NUMBER, IN, OUT, OUT), (a[0], n[0], a[1], a[2], a[3]))                  \
    INVOKER(annr, (IN, NUMBER, NUMBER, OUT), (a[0], n[0], n[1], a[1]))                          \
    INVOKER(annrr, (IN, NUMBER, NUMBER, OUT, OUT), (a[0], n[0], n[1], a[1], a[2]))              \
    INVOKER(naar, (NUMBER, IN, IN, OUT), (n[0], a[0], a[1], a[2]))                              \
    INVOKER(naarr, (NUMBER, IN, IN, OUT, OUT), (n[0], a[0], a[1], a[2], a[3]))                  \
    INVOKER(nanr, (NUMBER, IN, NUMBER, OUT), (n[0], a[0], n[1], a[1]))                          \
    INVOKER(nanrr, (NUMBER, IN, NUMBER, OUT, OUT), (n[0], a[0], n[1], a[1], a[2]))              \
    INVOKER(nnar, (NUMBER, NUMBER, IN, OUT), (n[0], n[1], a[0], a[1]))                          \
    INVOKER(nnarr, (NUMBER, NUMBER, IN, OUT, OUT), (n[0], n[1], a[0], a[1], a[2]))              \
    INVOKER(nnnr, (NUMBER, NUMBER, NUMBER, OUT), (n[0], n[1], n[2], a[0]))                      \
    INVOKER(nnnrr, (NUMBER, NUMBER, NUMBER, OUT, OUT), (n[0], n[1], n[2], a[0], a[1]))          \
    INVOKER(aaaar, (IN, IN, IN, IN, OUT), (a[0], a[1], a[2], a[3], a[4]))                       \
    INVOKER(aaaarr, (IN, IN, IN, IN, OUT, OUT), (a[0], a[1], a[2], a[3], a[4], a[5]))           \
    INVOKER(aaanr, (IN, IN, IN, NUMBER, OUT), (a[0], a[1], a[2], n[0], a[3]))                   \
    INVOKER(aaanrr, (IN, IN, IN, NUMBER, OUT, OUT), (a[0], a[1], a[2], n[0], a[3], a[4]))       \
    INVOKER(aanar, (IN, IN, NUMBER, IN, OUT), (a[0], a[1], n[0], a[2], a[3]))                   \
    INVOKER(aanarr, (IN, IN, NUMBER, IN, OUT, OUT), (a[0], a[1], n[0], a[2], a[3], a[4]))       \
    INVOKER(aannr, (IN, IN, NUMBER, NUMBER, OUT), (a[0], a[1], n[0], n[1], a[2]))               \
    INVOKER(aannrr, (IN, IN, NUMBER, NUMBER, OUT, OUT), (a[0], a[1], n[0], n[1], a[2], a[3]))   \
    INVOKER(anaar, (IN, NUMBER, IN, IN, OUT), (a[0], n[0], a[1], a[2], a[3]))                   \
    INVOKER(anaarr, (IN, NUMBER, IN, IN, OUT, OUT), (a[0], n[0], a[1], a[2], a[3], a[4]))       \
    INVOKER(ananr, (IN, NUMBER, IN, NUMBER, OUT), (a[0], n[0], a[1], n[1], a[2]))               \
    INVOKER(ananrr, (IN, NUMBER, IN, NUMBER, OUT, OUT), (a[0], n[0], a[1], n[1], a[2], a[3]))   \
    INVOKER(annar, (IN, NUMBER, NUMBER, IN, OUT), (a[0], n[0], n[1], a[1], a[2]))               \
    INVOKER(annarr, (IN, NUMBER, NUMBER, IN, OUT, OUT), (a[0], n[0], n[1], a[1], a[2], a[3]))   \
    INVOKER(annnr, (IN, NUMBER, NUMBER, NUMBER, OUT), (a[0], n[0], n[1], n[2], a[1]))           \
    INVOKER(annnrr, (IN, NUMBER, NUMBER, NUMBER, OUT, OUT), (a[0], n[0], n[1], n[2], a[1], a[2]))\
    INVOKER(naaar, (NUMBER, IN, IN, IN, OUT), (n[0], a[0], a[1], a[2], a[3]))                   \
    INVOKER(naaarr, (NUMBER, IN, IN, IN, OUT, OUT), (n[0], a[0], a[1], a[2], a[3], a[4]))       \
    INVOKER(naanr, (NUMBER, IN, IN, NUMBER, OUT), (n[0], a[0], a[1], n[1], a[2]))               \
    INVOKER(naanrr, (NUMBER, IN, IN, NUMBER, OUT, OUT), (n[0], a[0], a[1], n[1], a[2], a[3]))   \
    INVOKER(nanar, (NUMBER, IN, NUMBER, IN, OUT), (n[0], a[0], n[1], a[1], a[2]))               \
    INVOKER(nanarr, (NUMBER, IN, NUMBER, IN, OUT, OUT), (n[0], a[0], n[1], a[1], a[2], a[3]))   \
    INVOKER(nannr, (NUMBER, IN, NUMBER, NUMBER, OUT), (n[0], a[0], n[1], n[2], a[1]))           \
    INVOKER(nannrr, (NUMBER, IN, NUMBER, NUMBER, OUT, OUT), (n[0], a[0], n[1], n[2], a[1], a[2]))\
    INVOKER(nnaar, (NUMBER, NUMBER, IN, IN, OUT), (n[0], n[1], a[0], a[1], a[2]))               \
    INVOKER(nnaarr, (NUMBER, NUMBER, IN, IN, OUT, OUT), (n[0], n[1], a[0], a[1], a[2], a[3]))   \
    INVOKER(nnanr, (NUMBER, NUMBER, IN, NUMBER, OUT), (n[0], n[1], a[0], n[2], a[1]))           \
    INVOKER(nnanrr, (NUMBER, NUMBER, IN, NUMBER, OUT, OUT), (n[0], n[1], a[0], n[2], a[1], a[2]))\
    INVOKER(nnnar, (NUMBER, NUMBER, NUMBER, IN, OUT), (n[0], n[1], n[2], a[0], a[1]))           \
    INVOKER(nnnarr, (NUMBER, NUMBER, NUMBER, IN, OUT, OUT), (n[0], n[1], n[2], a[0], a[1], a[2]))\
    INVOKER(nnnnr, (NUMBER, NUMBER, NUMBER, NUMBER, OUT), (n[0], n[1], n[2], n[3], a[0]))       \
    INVOKER(nnnnrr, (NUMBER, NUMBER, NUMBER, NUMBER, OUT, OUT), (n[0], n[1], n[2], n[3], a[0], a[1]))
#define INVOKER(kinds, types, arguments)                                                        \
    static void invoke_##kinds(Function function, double *const *a, const double *n)            \
    {                                                                                           \
        (void)n;                                                                                \
        ((void (*) types)function)arguments;                                                    \
    }
INVOKERS(INVOKER)
#undef INVOKER

static const struct {
    const char *kinds;
    Invoke invoke;
} INVOKERS[] = {
#define INVOKER(kinds, types, arguments) {#kinds, invoke_##kinds},
    INVOKERS(INVOKER)
#undef INVOKER
};

/* The stable layout of numpy arrays (ndarraytypes.h), so that building this needs no numpy. `prepare` verifies it. */
typedef struct {
    PyObject_HEAD
    char *data;
    int n_axes;
    Py_ssize_t *shape;
    Py_ssize_t *strides;
    PyObject *base;
    PyObject *dtype;
    int flags;
} Array;

typedef struct {
    PyObject_HEAD
    PyTypeObject *scalar;
    char kind, letter, order, unused;
    int number;
} DataType;

#define IN_C_ORDER 0x001
#define ALIGNED 0x100
#define WRITEABLE 0x400
#define VERSION_FUNCTION 0
#define NEW_FUNCTION 94

typedef PyObject *(*NewArray)(
    PyTypeObject *type, PyObject *dtype, int n_axes, const Py_ssize_t *shape, const Py_ssize_t *strides, void *data,
    int flags, PyObject *like
);

/* A numpy scalar in single precision. Double-precision scalars inherit from float and have its layout. */
typedef struct {
    PyObject_HEAD
    float value;
} Single;

static PyTypeObject *array_type, *number_type, *single_type;
/* The class of numbers that operators of values return: a subclass of float without additional data; may be NULL. */
static PyTypeObject *scalar_type;
static PyObject *double_type, *float_type;
static NewArray new_array;
static PyObject *word_out, *word_in_python, *word_kind, *word_power, *word_reflected_power;
static PyObject *word_backend, *word_num_threads, *word_equals, *word_hash;

/* Python's operators on two values, the call of a value, its power, and the operators on one, as C and Python name
   them. Powers with these exponents are operators on one value. */
#define BINARY(OPERATOR)                                                                        \
    OPERATOR(multiply, "*")                                                                     \
    OPERATOR(xor, "^")                                                                          \
    OPERATOR(and, "&")                                                                          \
    OPERATOR(or, "|")                                                                           \
    OPERATOR(add, "+")                                                                          \
    OPERATOR(subtract, "-")                                                                     \
    OPERATOR(true_divide, "/")                                                                  \
    OPERATOR(rshift, ">>")
#define UNARY(OPERATOR)                                                                         \
    OPERATOR(invert, "~")                                                                       \
    OPERATOR(negative, "-")
#define POWERS(OPERATOR)                                                                        \
    OPERATOR(square, "**2")                                                                     \
    OPERATOR(cube, "**3")                                                                       \
    OPERATOR(reciprocal, "**-1")
#define SYMBOL(name, text) SYMBOL_##name,
#define ONE_OPERAND(name, text) 1,
#define TWO_OPERANDS(name, text) 2,
#define TEXT(name, text) text,

enum { BINARY(SYMBOL) SYMBOL_call, SYMBOL_power, UNARY(SYMBOL) POWERS(SYMBOL) N_SYMBOLS };

static const Py_ssize_t N_OPERANDS[] = {BINARY(TWO_OPERANDS) 2, 2, UNARY(ONE_OPERAND) POWERS(ONE_OPERAND)};
static PyObject *symbols[N_SYMBOLS];

/* Arguments that need no conversion: numbers, and arrays of one shape in C order. */

static inline int is_number(PyObject *object, double *number)
{
    if (PyFloat_CheckExact(object) || Py_TYPE(object) == number_type || Py_TYPE(object) == scalar_type) {
        *number = PyFloat_AS_DOUBLE(object);
        return 1;
    }
    if (PyLong_CheckExact(object)) {
        int overflow;
        const long long whole = PyLong_AsLongLongAndOverflow(object, &overflow);
        *number = (double)whole;
        return !overflow;
    }
    return 0;
}

static inline int is_single(PyObject *object, double *number)
{
    if (Py_TYPE(object) != single_type)
        return 0;
    *number = ((Single *)object)->value;
    return 1;
}

/* Numbers as results of kernels. */

static PyObject *new_number(double x)
{
    PyObject *number = number_type->tp_alloc(number_type, 0);
    if (number != NULL)
        ((PyFloatObject *)number)->ob_fval = x;
    return number;
}

static PyObject *new_single(float x)
{
    PyObject *number = single_type->tp_alloc(single_type, 0);
    if (number != NULL)
        ((Single *)number)->value = x;
    return number;
}

typedef struct {
    int n_axes;
    Py_ssize_t axes[MAX_AXES];
} Shape;

/* `double_type` or `float_type` if the dtype of the array is equal to it, else NULL. The dtype object may be a copy, as
   for unpickled arrays. */
static inline PyObject *real_type(const Array *array)
{
    PyObject *dtype = array->dtype;
    if (dtype == double_type || dtype == float_type)
        return dtype;
    if (((const DataType *)dtype)->order != '=')
        return NULL;
    return Py_TYPE(dtype) == Py_TYPE(double_type) ? double_type
           : Py_TYPE(dtype) == Py_TYPE(float_type) ? float_type : NULL;
}

static inline int is_dense(PyObject *object, const Shape *shape, int flags)
{
    const Array *array = (const Array *)object;
    if (Py_TYPE(object) != array_type || real_type(array) != double_type || (array->flags & flags) != flags ||
        array->n_axes != shape->n_axes)
        return 0;
    for (int k = 0; k < shape->n_axes; k++)
        if (array->shape[k] != shape->axes[k])
            return 0;
    return 1;
}

/* Values: objects that contain the coefficients of one element. */

typedef struct Kind Kind;

typedef struct {
    Function function;
    Kind *result; /* NULL if the result is a number: of `scalar_type` if that is set, else a float. */
    int swapped;
    int is_scalar;
    Py_ssize_t n_limits;
    double *limits; /* Those of the squared norm of a divisor, outside of which Python runs the operation, or NULL. */
} Operation;

/* Whether the squared norm of a divisor is in the range of doubles, and not 0 up to rounding. The limits are those of
   the sum of its absolute terms, the least ratio to that sum, and for each term its factor and two places. */
static int is_divisor(const Operation *operation, const double *x)
{
    const double *limits = operation->limits;
    double total = 0, size = 0;
    for (Py_ssize_t k = 3; k < operation->n_limits; k += 3) {
        const double term = limits[k] * x[(int)limits[k + 1]] * x[(int)limits[k + 2]];
        total += term;
        size += __builtin_fabs(term);
    }
    return limits[0] < size && size < limits[1] && __builtin_fabs(total) > limits[2] * size;
}

/* Operators run and are bound with the GIL: Python without it enables it when it loads this module, which does not
   declare that it can do without. Bindings are therefore changed in place, although other threads use them.

   Memory of up to MOST_SPARE deallocated values of each kind is reused for new ones, which speeds up loops. */
#ifdef Py_GIL_DISABLED
enum { MOST_SPARE = 0, SPARE_ROOM = 1 };
#else
enum { MOST_SPARE = 8, SPARE_ROOM = MOST_SPARE };
#endif

/* The layout of values of one type. Kinds of one module share `operate`, the module's fallback in Python. */
struct Kind {
    PyTypeObject *type;
    Py_ssize_t size;
    Py_ssize_t index;
    PyObject *operate;
    PyObject *coefficients;
    PyObject *layout; /* What identifies the layout among those of kernels; NULL if nothing does. */
    PyObject *keys, *fixed; /* What hashes take for blades, and a set of pairs for fixed ones; NULL if Python hashes. */
    int is_unit; /* Whether kernels take the values for arguments of unit norm without looking at their coefficients. */
    PyMemberDef *fields;
    richcmpfunc order; /* Compares by order, as the Python methods of the class do; NULL if it has none. */
    Operation *operations[N_SYMBOLS];
    Py_ssize_t n_operations[N_SYMBOLS];
    int n_spares;
    PyObject *spares[SPARE_ROOM];
};

typedef struct {
    PyObject_VAR_HEAD
    vectorcallfunc vectorcall;
    Kind *kind;
    double x[];
} Value;

static Py_hash_t value_hash(PyObject *self);
static PyObject *value_vectorcall(PyObject *self, PyObject *const *args, size_t n, PyObject *names);

static inline int is_value(PyObject *object)
{
    return Py_TYPE(object)->tp_hash == value_hash;
}

static Value *new_value(Kind *kind)
{
    Value *value;
    if (kind->n_spares > 0) {
        value = (Value *)kind->spares[--kind->n_spares];
    } else {
        value = PyObject_Malloc(offsetof(Value, x) + (size_t)kind->size * sizeof(double));
        if (value == NULL)
            return (Value *)PyErr_NoMemory();
        value->vectorcall = value_vectorcall;
        value->kind = kind;
    }
    PyObject_InitVar((PyVarObject *)value, kind->type, kind->size);
    return value;
}

static void value_dealloc(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    Kind *kind = ((Value *)self)->kind;
    if (kind->n_spares < MOST_SPARE)
        kind->spares[kind->n_spares++] = self;
    else
        PyObject_Free(self);
    Py_DECREF(type);
}

static Kind *kind_of(PyTypeObject *type)
{
    PyObject *capsule = type->tp_dict == NULL ? NULL : PyDict_GetItemWithError(type->tp_dict, word_kind);
    if (capsule == NULL) {
        if (!PyErr_Occurred())
            PyErr_Format(
                PyExc_TypeError, "%s has no layout and cannot be instantiated; use a type with a layout", type->tp_name
            );
        return NULL;
    }
    return PyCapsule_GetPointer(capsule, "Kind");
}

static int copied(Value *value, PyObject *object)
{
    const Shape shape = {1, {value->kind->size}};
    if (!is_dense(object, &shape, IN_C_ORDER | ALIGNED))
        return 0;
    memcpy(value->x, ((Array *)object)->data, (size_t)value->kind->size * sizeof(double));
    return 1;
}

static int fill(Value *value, PyObject *const *args, Py_ssize_t n)
{
    const Kind *kind = value->kind;
    Py_ssize_t filled = 0;
    if (n == kind->size)
        while (filled < n && is_number(args[filled], &value->x[filled]))
            filled++;
    if (filled == kind->size || (n == 1 && copied(value, args[0])))
        return 0;
    PyObject *tuple = PyTuple_New(n);
    if (tuple == NULL)
        return -1;
    for (Py_ssize_t k = 0; k < n; k++)
        PyTuple_SET_ITEM(tuple, k, Py_NewRef(args[k]));
    PyObject *array = PyObject_CallFunctionObjArgs(kind->coefficients, (PyObject *)kind->type, tuple, NULL);
    Py_DECREF(tuple);
    if (array != NULL && !copied(value, array))
        PyErr_SetString(PyExc_SystemError, "the coefficients of a value are not an array of its size");
    Py_XDECREF(array);
    return PyErr_Occurred() ? -1 : 0;
}

static PyObject *make_value(PyTypeObject *type, PyObject *const *args, Py_ssize_t n, int named)
{
    Kind *kind = kind_of(type);
    if (kind == NULL)
        return NULL;
    if (named)
        return PyErr_Format(PyExc_TypeError, "%s() takes no keyword arguments", type->tp_name);
    Value *value = new_value(kind);
    if (value != NULL && fill(value, args, n) < 0)
        Py_CLEAR(value);
    return (PyObject *)value;
}

static PyObject *type_vectorcall(PyObject *type, PyObject *const *args, size_t n, PyObject *names)
{
    return make_value(
        (PyTypeObject *)type, args, PyVectorcall_NARGS(n), names != NULL && PyTuple_GET_SIZE(names) > 0
    );
}

static PyObject *value_new(PyTypeObject *type, PyObject *args, PyObject *names)
{
    return make_value(
        type, ((PyTupleObject *)args)->ob_item, PyTuple_GET_SIZE(args), names != NULL && PyDict_GET_SIZE(names) > 0
    );
}

/* Operators. */

/* The kind that floats have in operations with values; NULL if there is none. */
static Kind *number_kind;

PyDoc_STRVAR(
    set_number_doc,
    "set_number(type, scalar)\n--\n\n"
    "Treat Python numbers as values of this type in operations with values of its module.\n\n"
    "Operators that return numbers use the class `scalar`, a subclass of float without additional data."
);

static PyObject *set_number(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyTypeObject *type, *scalar;
    if (!PyArg_ParseTuple(args, "O!O!", &PyType_Type, &type, &PyType_Type, &scalar))
        return NULL;
    Kind *kind = kind_of(type);
    if (kind == NULL)
        return NULL;
    if (!PyType_IsSubtype(scalar, &PyFloat_Type) || scalar->tp_basicsize != PyFloat_Type.tp_basicsize)
        return PyErr_Format(
            PyExc_TypeError, "%s: expected a subclass of float without additional data", scalar->tp_name
        );
    number_kind = kind;
    Py_XSETREF(scalar_type, (PyTypeObject *)Py_NewRef((PyObject *)scalar));
    Py_RETURN_NONE;
}

static PyObject *new_scalar(double x)
{
    PyObject *number = scalar_type->tp_alloc(scalar_type, 0);
    if (number != NULL)
        ((PyFloatObject *)number)->ob_fval = x;
    return number;
}

/* The kind of an operand, and its coefficients; NULL if it is neither a value nor a number. */
static inline const Kind *operand(PyObject *object, const double **x, double *number)
{
    if (is_value(object)) {
        *x = ((Value *)object)->x;
        return ((Value *)object)->kind;
    }
    *x = number;
    return number_kind != NULL && is_number(object, number) ? number_kind : NULL;
}

static PyObject *run_operation(const Operation *operation, const double *a, const double *b)
{
    double number;
    Value *result = NULL;
    double *out = &number;
    if (operation->result != NULL) {
        result = new_value(operation->result);
        if (result == NULL)
            return NULL;
        out = result->x;
    }
    if (b == NULL)
        ((void (*)(const double *, double *))operation->function)(a, out);
    else
        ((void (*)(const double *, const double *, double *))operation->function)(a, b, out);
    if (result != NULL)
        return (PyObject *)result;
    return operation->is_scalar ? new_scalar(number) : PyFloat_FromDouble(number);
}

static PyObject *operate_two(int symbol, PyObject *a, PyObject *b)
{
    const double *x, *y;
    double numbers[2];
    const Kind *left = operand(a, &x, &numbers[0]), *right = operand(b, &y, &numbers[1]);
    /* Python reports a number 0 as divisor. */
    const int divides_by_zero = symbol == SYMBOL_true_divide && right == number_kind && right != NULL && *y == 0;
    const int known = left != NULL && right != NULL && left->operate == right->operate && !divides_by_zero;
    if (known && right->index < left->n_operations[symbol]) {
        const Operation *operation = &left->operations[symbol][right->index];
        if (operation->function != NULL && (operation->limits == NULL || is_divisor(operation, y)))
            return operation->swapped ? run_operation(operation, y, x) : run_operation(operation, x, y);
    }
    const int is_left = is_value(a);
    if (!is_left && !is_value(b))
        Py_RETURN_NOTIMPLEMENTED;
    return PyObject_CallFunctionObjArgs(((Value *)(is_left ? a : b))->kind->operate, symbols[symbol], a, b, NULL);
}

static PyObject *operate_one(int symbol, PyObject *a)
{
    const Kind *kind = ((Value *)a)->kind;
    if (kind->n_operations[symbol] && kind->operations[symbol][0].function != NULL)
        return run_operation(&kind->operations[symbol][0], ((Value *)a)->x, NULL);
    return PyObject_CallFunctionObjArgs(kind->operate, symbols[symbol], a, NULL);
}

#define VALUE_BINARY(name, text)                                                                \
    static PyObject *value_##name(PyObject *a, PyObject *b)                                     \
    {                                                                                           \
        return operate_two(SYMBOL_##name, a, b);                                                \
    }
#define VALUE_UNARY(name, text)                                                                 \
    static PyObject *value_##name(PyObject *a)                                                  \
    {                                                                                           \
        return operate_one(SYMBOL_##name, a);                                                   \
    }
BINARY(VALUE_BINARY)
UNARY(VALUE_UNARY)

/* The power of a class that defines it in Python, where no compiled function is known for the exponent. */
static PyObject *value_power(PyObject *a, PyObject *b, PyObject *modulus)
{
    if (modulus != Py_None)
        Py_RETURN_NOTIMPLEMENTED;
    if (!is_value(a))
        return PyObject_CallMethodObjArgs(b, word_reflected_power, a, NULL);
    const Kind *kind = ((Value *)a)->kind;
    if (PyLong_CheckExact(b)) {
        int overflow;
        const long exponent = PyLong_AsLongAndOverflow(b, &overflow);
        const int symbol = exponent == 2 ? SYMBOL_square : exponent == 3 ? SYMBOL_cube : SYMBOL_reciprocal;
        const Operation *operation = kind->operations[symbol];
        if ((exponent == 2 || exponent == 3 || exponent == -1) && kind->n_operations[symbol] &&
            (operation->limits == NULL || is_divisor(operation, ((Value *)a)->x)))
            return run_operation(operation, ((Value *)a)->x, NULL);
    }
    if (PyFloat_CheckExact(b) && number_kind != NULL && number_kind->index < kind->n_operations[SYMBOL_power]) {
        const Operation *operation = &kind->operations[SYMBOL_power][number_kind->index];
        if (operation->function != NULL && operation->result != NULL) {
            const double exponent = PyFloat_AS_DOUBLE(b);
            PyObject *result = run_operation(operation, ((Value *)a)->x, &exponent);
            double sum = 0;
            for (Py_ssize_t k = 0; result != NULL && k < Py_SIZE(result); k++)
                sum += ((Value *)result)->x[k];
            if (result == NULL || sum - sum == 0)
                return result;
            Py_DECREF(result); /* Python reports a power that is not determined. */
        }
    }
    /* The values of generated modules have no powers, and get here if the exponent is a value that has. */
    PyObject *power = PyObject_GetAttr((PyObject *)Py_TYPE(a), word_power);
    if (power == NULL) {
        if (!PyErr_ExceptionMatches(PyExc_AttributeError))
            return NULL;
        PyErr_Clear();
        Py_RETURN_NOTIMPLEMENTED;
    }
    PyObject *result = PyObject_CallFunctionObjArgs(power, a, b, NULL);
    Py_DECREF(power);
    return result;
}

static PyObject *value_vectorcall(PyObject *self, PyObject *const *args, size_t nargsf, PyObject *names)
{
    const Py_ssize_t n = PyVectorcall_NARGS(nargsf);
    if (names != NULL && PyTuple_GET_SIZE(names) > 0)
        return PyErr_Format(PyExc_TypeError, "%s takes no keyword arguments", Py_TYPE(self)->tp_name);
    if (n == 1)
        return operate_two(SYMBOL_call, self, args[0]);
    PyObject *all = PyTuple_New(n + 2);
    if (all == NULL)
        return NULL;
    PyTuple_SET_ITEM(all, 0, Py_NewRef(symbols[SYMBOL_call]));
    PyTuple_SET_ITEM(all, 1, Py_NewRef(self));
    for (Py_ssize_t k = 0; k < n; k++)
        PyTuple_SET_ITEM(all, k + 2, Py_NewRef(args[k]));
    PyObject *result = PyObject_Call(((Value *)self)->kind->operate, all, NULL);
    Py_DECREF(all);
    return result;
}

static PyObject *value_compare(PyObject *a, PyObject *b, int how)
{
    if (how != Py_EQ && how != Py_NE && is_value(a) && ((Value *)a)->kind->order != NULL)
        return ((Value *)a)->kind->order(a, b, how);
    if ((how != Py_EQ && how != Py_NE) || !is_value(a) || b == Py_None)
        Py_RETURN_NOTIMPLEMENTED;
    const Kind *left = ((Value *)a)->kind, *right = is_value(b) ? ((Value *)b)->kind : NULL;
    if (right != left && (left->layout == NULL || right == NULL || left->layout != right->layout)) {
        if (left->layout == NULL || (right != NULL && right->layout == NULL))
            Py_RETURN_NOTIMPLEMENTED;
        PyObject *found = PyObject_CallMethodOneArg(a, word_equals, b);
        if (found == NULL || found == Py_NotImplemented || how == Py_EQ)
            return found;
        PyObject *differs = PyBool_Check(found) ? PyBool_FromLong(found == Py_False) : PyNumber_Invert(found);
        Py_DECREF(found);
        return differs;
    }
    int same = 1;
    for (Py_ssize_t k = 0; k < Py_SIZE(a); k++)
        same &= ((Value *)a)->x[k] == ((Value *)b)->x[k];
    return PyBool_FromLong(same == (how == Py_EQ));
}

static Py_hash_t value_hash(PyObject *self)
{
    const Kind *kind = ((Value *)self)->kind;
    const double *x = ((Value *)self)->x;
    if (kind->keys == NULL) {
        PyObject *found = PyObject_CallMethodNoArgs(self, word_hash);
        const Py_hash_t hash = found == NULL ? -1 : PyLong_AsSsize_t(found);
        Py_XDECREF(found);
        return hash;
    }
    PyObject *pairs = PyFrozenSet_New(kind->fixed);
    int failed = pairs == NULL, is_scalar = PyTuple_GET_SIZE(kind->fixed) == 0;
    double scalar = 0;
    for (Py_ssize_t k = 0; k < Py_SIZE(self) && !failed; k++) {
        if (x[k] == 0 || x[k] != x[k])
            continue;
        PyObject *key = PyTuple_GET_ITEM(kind->keys, k);
        if (PyUnicode_CompareWithASCIIString(key, "1") == 0)
            scalar = x[k];
        else
            is_scalar = 0;
        PyObject *pair = Py_BuildValue("(Od)", key, __builtin_fabs(x[k]));
        failed = pair == NULL || PySet_Add(pairs, pair) < 0;
        Py_XDECREF(pair);
    }
    PyObject *hashed = failed ? NULL : is_scalar ? PyFloat_FromDouble(scalar) : Py_NewRef(pairs);
    const Py_hash_t hash = hashed == NULL ? -1 : PyObject_Hash(hashed);
    Py_XDECREF(hashed);
    Py_XDECREF(pairs);
    return hash;
}

static PyObject *value_numbers(PyObject *self, PyObject *Py_UNUSED(args))
{
    PyObject *numbers = PyList_New(Py_SIZE(self));
    for (Py_ssize_t k = 0; numbers != NULL && k < Py_SIZE(self); k++) {
        PyObject *number = PyFloat_FromDouble(((Value *)self)->x[k]);
        if (number == NULL) {
            Py_DECREF(numbers);
            return NULL;
        }
        PyList_SET_ITEM(numbers, k, number);
    }
    return numbers;
}

static int value_buffer(PyObject *self, Py_buffer *view, int flags)
{
    static Py_ssize_t stride = sizeof(double);
    view->obj = NULL;
    if (flags & PyBUF_WRITABLE) {
        PyErr_SetString(PyExc_BufferError, "a value is immutable; expected a read-only buffer request");
        return -1;
    }
    /* numpy requests a format; refused, it calls `__array__`. `numpy.frombuffer`, which is told the type, does not. */
    if (flags & PyBUF_FORMAT) {
        PyErr_Format(PyExc_BufferError, "%s is an element; expected an array, its .values", Py_TYPE(self)->tp_name);
        return -1;
    }
    view->obj = Py_NewRef(self);
    view->buf = ((Value *)self)->x;
    view->len = Py_SIZE(self) * stride;
    view->readonly = 1;
    view->itemsize = stride;
    view->format = NULL;
    view->ndim = 1;
    view->shape = flags & PyBUF_ND ? &((Value *)self)->kind->size : NULL;
    view->strides = (flags & PyBUF_STRIDES) == PyBUF_STRIDES ? &stride : NULL;
    view->suboffsets = NULL;
    view->internal = NULL;
    return 0;
}

static void free_kind(PyObject *capsule)
{
    Kind *kind = PyCapsule_GetPointer(capsule, "Kind");
    for (int k = 0; k < N_SYMBOLS; k++) {
        for (Py_ssize_t i = 0; i < kind->n_operations[k]; i++)
            PyMem_Free(kind->operations[k][i].limits);
        PyMem_Free(kind->operations[k]);
    }
    while (kind->n_spares > 0)
        PyObject_Free(kind->spares[--kind->n_spares]);
    PyMem_Free(kind->fields);
    Py_XDECREF(kind->operate);
    Py_XDECREF(kind->coefficients);
    Py_XDECREF(kind->layout);
    Py_XDECREF(kind->keys);
    Py_XDECREF(kind->fixed);
    PyMem_Free(kind);
}

PyDoc_STRVAR(
    adopt_doc,
    "_adopt(index, names, operate, coefficients, layout, is_unit=True, hashed=None)\n--\n\n"
    "Make this class a type of values with a coefficient for each name; `index` is its number in the module. Kernels\n"
    "take the values as they are for arguments with the same object as `layout`, of unit norm only if `is_unit`.\n\n"
    "Hashes are those of sets of pairs: `hashed` has the first entry for each coefficient, and further pairs. Without\n"
    "it, the method `_hash` of the class is called."
);

static PyObject *value_adopt(PyObject *cls, PyObject *args)
{
    PyTypeObject *type = (PyTypeObject *)cls;
    Py_ssize_t index;
    PyObject *names, *operate, *coefficients, *layout = NULL, *hashed = Py_None, *keys = NULL, *fixed = NULL;
    int is_unit = 1;
    if (!PyArg_ParseTuple(
            args, "nO!OO|OpO", &index, &PyTuple_Type, &names, &operate, &coefficients, &layout, &is_unit, &hashed
        ))
        return NULL;
    const Py_ssize_t size = PyTuple_GET_SIZE(names);
    if (hashed != Py_None && (!PyArg_ParseTuple(hashed, "O!O!", &PyTuple_Type, &keys, &PyTuple_Type, &fixed) ||
                              PyTuple_GET_SIZE(keys) != size))
        return PyErr_Format(PyExc_TypeError, "expected a key for each coefficient, and a tuple of pairs");
    Kind *kind = PyMem_Calloc(1, sizeof(Kind));
    if (kind == NULL)
        return PyErr_NoMemory();
    kind->type = type;
    kind->size = size;
    kind->index = index;
    kind->operate = Py_NewRef(operate);
    kind->coefficients = Py_NewRef(coefficients);
    kind->layout = layout == Py_None ? NULL : Py_XNewRef(layout);
    kind->keys = Py_XNewRef(keys);
    kind->fixed = Py_XNewRef(fixed);
    kind->is_unit = is_unit;
    PyObject *capsule = PyCapsule_New(kind, "Kind", free_kind);
    kind->fields = PyMem_Calloc((size_t)size, sizeof(PyMemberDef));
    int failed = capsule == NULL || kind->fields == NULL || PyObject_SetAttr(cls, word_kind, capsule) < 0;
    Py_XDECREF(capsule);
    for (Py_ssize_t k = 0; k < size && !failed; k++) {
        PyMemberDef *field = &kind->fields[k];
        /* The name is interned, and lives as long as the attribute of the class. */
        field->name = PyUnicode_AsUTF8(PyTuple_GET_ITEM(names, k));
        field->type = T_DOUBLE;
        field->offset = (Py_ssize_t)(offsetof(Value, x) + (size_t)k * sizeof(double));
        field->flags = READONLY;
        PyObject *descriptor = field->name == NULL ? NULL : PyDescr_NewMember(type, field);
        failed = descriptor == NULL || PyObject_SetAttr(cls, PyTuple_GET_ITEM(names, k), descriptor) < 0;
        Py_XDECREF(descriptor);
    }
    if (failed)
        return NULL;
    /* A class made by Python does not take short calls from its base before Python 3.12, and lets its objects be
       collected, for which they would need a header; numbers refer to nothing. No class is derived from this one. */
    type->tp_flags = (type->tp_flags | Py_TPFLAGS_HAVE_VECTORCALL) & ~(unsigned long)Py_TPFLAGS_HAVE_GC;
    /* A class that defines `<` or powers in Python has slots that look up their methods by name, also that of `==`. */
    if (type->tp_richcompare != value_compare) {
        kind->order = type->tp_richcompare;
        type->tp_richcompare = value_compare;
    }
    if (type->tp_as_number->nb_power != NULL)
        type->tp_as_number->nb_power = value_power;
    type->tp_vectorcall = type_vectorcall;
    type->tp_dealloc = value_dealloc;
    type->tp_free = PyObject_Free;
    type->tp_traverse = NULL;
    type->tp_clear = NULL;
    PyType_Modified(type);
    Py_RETURN_NONE;
}

PyDoc_STRVAR(
    bind_operator_doc,
    "bind_operator(symbol, operands, result, address, swapped, limits=b'')\n--\n\n"
    "Let an operator on values of these types run the kernel at an address. `result` is a type of values, the class\n"
    "of numbers passed to `set_number`, or None for float. `limits` are doubles, those of a squared norm: if that of\n"
    "the last operand is not between them, the operator runs in Python."
);

static PyObject *bind_operator(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *word, *operands, *result;
    unsigned long long address;
    int swapped;
    const char *limits = NULL;
    Py_ssize_t n_bytes = 0;
    if (!PyArg_ParseTuple(
            args, "UO!OKp|y#", &word, &PyTuple_Type, &operands, &result, &address, &swapped, &limits, &n_bytes
        ))
        return NULL;
    int symbol = 0;
    const Py_ssize_t n = PyTuple_GET_SIZE(operands);
    while (symbol < N_SYMBOLS && (N_OPERANDS[symbol] != n || PyUnicode_Compare(symbols[symbol], word) != 0))
        symbol++;
    if (symbol == N_SYMBOLS)
        return PyErr_Format(PyExc_ValueError, "no operator %R of %zd operands", word, n);
    Kind *kinds[2] = {NULL, NULL}, *result_kind = NULL;
    for (Py_ssize_t k = 0; k < n; k++) {
        kinds[k] = kind_of((PyTypeObject *)PyTuple_GET_ITEM(operands, k));
        if (kinds[k] == NULL)
            return NULL;
    }
    const int is_scalar = scalar_type != NULL && result == (PyObject *)scalar_type;
    if (result != Py_None && !is_scalar && (result_kind = kind_of((PyTypeObject *)result)) == NULL)
        return NULL;
    const Py_ssize_t index = n == 2 ? kinds[1]->index : 0;
    Kind *left = kinds[0];
    if (index >= left->n_operations[symbol]) {
        Operation *more = PyMem_Realloc(left->operations[symbol], (size_t)(index + 1) * sizeof(Operation));
        if (more == NULL)
            return PyErr_NoMemory();
        const Py_ssize_t known = left->n_operations[symbol];
        memset(more + known, 0, (size_t)(index + 1 - known) * sizeof(Operation));
        left->operations[symbol] = more;
        left->n_operations[symbol] = index + 1;
    }
    double *copy = NULL;
    if (n_bytes) {
        copy = PyMem_Malloc((size_t)n_bytes);
        if (copy == NULL)
            return PyErr_NoMemory();
        memcpy(copy, limits, (size_t)n_bytes);
    }
    PyMem_Free(left->operations[symbol][index].limits);
    left->operations[symbol][index] = (Operation){
        (Function)(uintptr_t)address, result_kind, swapped, is_scalar, n_bytes / (Py_ssize_t)sizeof(double), copy
    };
    Py_RETURN_NONE;
}

static PyMethodDef value_methods[] = {
    {"_adopt", value_adopt, METH_VARARGS | METH_CLASS, adopt_doc},
    {"_numbers", value_numbers, METH_NOARGS, "_numbers()\n--\n\nReturn the coefficients as a list."},
    {NULL, NULL, 0, NULL},
};

static PyMemberDef value_members[] = {
    {"__vectorcalloffset__", T_PYSSIZET, offsetof(Value, vectorcall), READONLY, NULL},
    {NULL, 0, 0, 0, NULL},
};

static PyType_Slot value_slots[] = {
    {Py_tp_doc, "The coefficients of one element, inside the object."},
    {Py_tp_new, value_new},
    {Py_tp_dealloc, value_dealloc},
    {Py_tp_call, PyVectorcall_Call},
    {Py_tp_richcompare, value_compare},
    {Py_tp_hash, value_hash},
    {Py_tp_methods, value_methods},
    {Py_tp_members, value_members},
    {Py_bf_getbuffer, value_buffer},
#define OPERATOR_SLOT(name, text) {Py_nb_##name, value_##name},
    BINARY(OPERATOR_SLOT)
    UNARY(OPERATOR_SLOT)
    {0, NULL},
};

static PyType_Spec value_spec = {
    "calls.Value",
    offsetof(Value, x),
    sizeof(double),
    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_VECTORCALL,
    value_slots,
};

/* Batches: the arguments of a library's loop for a call on arrays with leading axes. */

typedef void (*Loop)(char **starts, const intptr_t *dimensions, const intptr_t *steps);

/* Runs the loops of a kernel compiled by numba, described by its table; returns DONE on success. */
#define DONE -1
typedef intptr_t (*Driver)(const void *table, char **starts, const intptr_t *dimensions, const intptr_t *steps);

/* The implementation of a kernel for batches of one dtype: a loop, a driver, or none yet. */
typedef struct {
    Loop loop;
    Driver driver;
    const void *table;
} Way;

/* The types of a kernel's results where all arguments with coefficients are values of one kind of objects, which share
   `operate`; NULL for results that are arrays or numbers. */
#define MAX_FAMILIES 2
typedef struct {
    PyObject *operate;
    Kind *kinds[MAX_ARRAYS];
} Family;

/* A kernel: the expected arguments of its calls, and its implementations. */
typedef struct {
    PyObject_HEAD
    vectorcallfunc vectorcall;
    Function function; /* For one element of doubles; NULL if there is only a loop. */
    Invoke invoke;
    Way ways[2]; /* For doubles and for floats. */
    Py_ssize_t most; /* Larger batches of one row may run on several threads. */
    PyObject *settings; /* Contains the number of threads; borrowed, since the kernel holds its module. */
    PyObject *layouts; /* A tuple of what identifies the layouts of the arguments; borrowed from the kernel too. */
    Py_ssize_t patience; /* Larger batches release the GIL. */
    int n_inputs; /* 0 until the kernel can be run. */
    int n_outputs;
    int n_elements; /* The number of arguments with coefficients. */
    unsigned units; /* A bit for each argument of unit norm. */
    int n_families;
    Family families[MAX_FAMILIES];
    Shape shapes[MAX_ARRAYS];
    intptr_t steps[MAX_ARRAYS * (1 + MAX_AXES)]; /* Strides of one element in C order. */
} Call;

/* Runs a batch, and returns whether that succeeded. */
static inline int go(const Way *way, char **starts, const intptr_t *dimensions, const intptr_t *steps)
{
    if (way->loop == NULL)
        return way->driver != NULL && way->driver(way->table, starts, dimensions, steps) == DONE;
    way->loop(starts, dimensions, steps);
    return 1;
}

typedef union {
    double f64;
    float f32;
} Number;

typedef struct {
    PyObject *dtype;
    Py_ssize_t width; /* Bytes of one number. */
    int n_axes; /* Number of leading axes. */
    Py_ssize_t axes[MAX_LEADING + MAX_AXES]; /* The last of them end at MAX_LEADING. */
    Number numbers[MAX_ARRAYS];
    char *starts[MAX_ARRAYS];
    intptr_t strides[MAX_ARRAYS][MAX_LEADING]; /* Strides between elements, along the last `n_axes`. */
    intptr_t steps[MAX_ARRAYS * (1 + MAX_AXES)]; /* Strides between elements of a row, then within elements. */
    intptr_t *inner;
} Batch;

/* Programs: kernels whose lines are run one after the other on blocks of elements, before they are compiled.

   A program is a sequence of words: the numbers of inputs, results, constants, lines and slots; the number of
   coefficients of each input, 0 for a number; the slots of the results; the constants, as bits; and the lines, of five
   words each: an operation, the slot that it writes, and three that it reads. A slot has one number of each element of
   a block. The first slots are those of inputs and constants; a line writes no slot that it reads. */

#define BLOCK 64
#define OPERATIONS(OPERATION)                                                                   \
    OPERATION(add, a[i] + b[i])                                                                 \
    OPERATION(subtract, a[i] - b[i])                                                            \
    OPERATION(multiply, a[i] * b[i])                                                            \
    OPERATION(add_product, c[i] + a[i] * b[i])                                                  \
    OPERATION(subtract_product, c[i] - a[i] * b[i])                                             \
    OPERATION(divide, a[i] / b[i])                                                              \
    OPERATION(negate, -a[i])                                                                    \
    OPERATION(sqrt, __builtin_sqrt(a[i]))                                                       \
    OPERATION(abs, __builtin_fabs(a[i]))                                                        \
    OPERATION(minimum, a[i] < b[i] || a[i] != a[i] ? a[i] : b[i])                               \
    OPERATION(maximum, a[i] > b[i] || a[i] != a[i] ? a[i] : b[i])                               \
    OPERATION(less, (double)(a[i] < b[i]))                                                      \
    OPERATION(less_equal, (double)(a[i] <= b[i]))                                               \
    OPERATION(equal, (double)(a[i] == b[i]))                                                    \
    OPERATION(select, a[i] != 0 ? b[i] : c[i])
#define OPERATION_NAME(name, value) #name " "
#define OPERATION_CODE(name, value) CODE_##name,
#define OPERATION_CASE(name, value)                                                             \
    case CODE_##name:                                                                           \
        for (int i = 0; i < BLOCK; i++)                                                         \
            out[i] = value;                                                                     \
        break;

enum { OPERATIONS(OPERATION_CODE) N_OPERATIONS };

static inline __attribute__((always_inline)) void run_lines(const int64_t *line, int64_t n_lines, double *slots)
{
    for (int64_t k = 0; k < n_lines; k++, line += 5) {
        double *restrict out = slots + line[1] * BLOCK;
        const double *a = slots + line[2] * BLOCK, *b = slots + line[3] * BLOCK, *c = slots + line[4] * BLOCK;
        switch (line[0]) {
            OPERATIONS(OPERATION_CASE)
        }
    }
}

static inline __attribute__((always_inline)) void multiply_all(
    double *restrict to, const double *restrict a, const double *restrict b, intptr_t n
)
{
    for (intptr_t i = 0; i < n; i++)
        to[i] = a[i] * b[i];
}

static void multiply_anywhere(double *to, const double *a, const double *b, intptr_t n)
{
    multiply_all(to, a, b, n);
}

static void run_lines_anywhere(const int64_t *lines, int64_t n_lines, double *slots)
{
    run_lines(lines, n_lines, slots);
}

/* Writes rows as columns: ``to[k * step + i] = rows[i][k]`` for `n` columns. There are pointers to rows up to the next
   multiple of 4. If `is_long`, the numbers of rows may be read up to the next multiple of 4, too. */
static void exchange(double *to, intptr_t step, const double *const *rows, int n_rows, int n, int is_long)
{
    (void)is_long;
    for (int k = 0; k < n; k++)
        for (int i = 0; i < n_rows; i++)
            to[k * step + i] = rows[i][k];
}

#if defined(__x86_64__)
#define IN_VECTORS __attribute__((target("avx2"))) static void

IN_VECTORS run_lines_in_vectors(const int64_t *lines, int64_t n_lines, double *slots)
{
    run_lines(lines, n_lines, slots);
}

/* Stores the first numbers of a vector; masked stores are slow on some processors. */
static inline __attribute__((target("avx2"), always_inline)) void store(double *to, __m256d x, int n)
{
    const __m128d low = _mm256_castpd256_pd128(x);
    if (n == 4)
        _mm256_storeu_pd(to, x);
    else if (n == 1)
        _mm_store_sd(to, low);
    else
        _mm_storeu_pd(to, low);
    if (n == 3)
        _mm_store_sd(to + 2, _mm256_extractf128_pd(x, 1));
}

IN_VECTORS multiply_in_vectors(double *to, const double *a, const double *b, intptr_t n)
{
    multiply_all(to, a, b, n);
}

IN_VECTORS exchange_in_vectors(
    double *to, intptr_t step, const double *const *rows, int n_rows, int n, int is_long
)
{
    static const int64_t words[] = {-1, -1, -1, -1, 0, 0, 0, 0};
    for (int i = 0; i < n_rows; i += 4) {
        const double *const *row = rows + i;
        const int height = n_rows - i < 4 ? n_rows - i : 4;
        for (int k = 0; k < n; k += 4) {
            const int width = n - k < 4 ? n - k : 4;
            const __m256i wide = _mm256_loadu_si256((const __m256i *)(words + 4 - width));
            __m256d a, b, c, d;
            if (width == 4 || is_long) {
                a = _mm256_loadu_pd(row[0] + k), b = _mm256_loadu_pd(row[1] + k);
                c = _mm256_loadu_pd(row[2] + k), d = _mm256_loadu_pd(row[3] + k);
            } else {
                a = _mm256_maskload_pd(row[0] + k, wide), b = _mm256_maskload_pd(row[1] + k, wide);
                c = _mm256_maskload_pd(row[2] + k, wide), d = _mm256_maskload_pd(row[3] + k, wide);
            }
            const __m256d ab = _mm256_unpacklo_pd(a, b), cd = _mm256_unpacklo_pd(c, d);
            const __m256d even = _mm256_unpackhi_pd(a, b), odd = _mm256_unpackhi_pd(c, d);
            double *out = to + k * step + i;
            store(out, _mm256_permute2f128_pd(ab, cd, 0x20), height);
            if (width > 1)
                store(out + step, _mm256_permute2f128_pd(even, odd, 0x20), height);
            if (width > 2)
                store(out + 2 * step, _mm256_permute2f128_pd(ab, cd, 0x31), height);
            if (width > 3)
                store(out + 3 * step, _mm256_permute2f128_pd(even, odd, 0x31), height);
        }
    }
}
#define HAS_VECTORS() __builtin_cpu_supports("avx2")
#else
#define run_lines_in_vectors run_lines_anywhere
#define exchange_in_vectors exchange
#define multiply_in_vectors multiply_anywhere
#define HAS_VECTORS() 0
#endif

/* Reads the coefficients of `n` elements into slots, whose rest gets those of the first one. */
static void read_slots(
    double *slots, const char *from, intptr_t step, intptr_t inner, int size, int n, int is_last, int vectors
)
{
    const intptr_t width = sizeof(double);
    if (step != width && inner == width) {
        const double *rows[BLOCK];
        const int n_rows = (n + 3) / 4 * 4;
        for (int i = 0; i < n_rows; i++)
            rows[i] = (const double *)(from + (i < n ? i : 0) * step);
        (vectors ? exchange_in_vectors : exchange)(
            slots, BLOCK, rows, n_rows, size, !is_last && step == size * width
        );
        for (int k = 0; k < size; k++)
            for (int i = n_rows; i < BLOCK; i++)
                slots[k * BLOCK + i] = slots[k * BLOCK];
        return;
    }
    for (int k = 0; k < size; k++, slots += BLOCK, from += inner) {
        if (step == width)
            memcpy(slots, from, (size_t)n * sizeof(double));
        else
            for (int i = 0; i < n; i++)
                slots[i] = *(const double *)(from + i * step);
        for (int i = n; i < BLOCK; i++)
            slots[i] = slots[0];
    }
}

static void write_slots(
    char *to, intptr_t step, intptr_t inner, const double *slots, const int64_t *results, int n_results, int n,
    int vectors
)
{
    const intptr_t width = sizeof(double);
    if (step == width || inner != width || step % width || n_results > BLOCK) {
        for (int k = 0; k < n_results; k++)
            for (int i = 0; i < n; i++)
                *(double *)(to + i * step + k * inner) = slots[results[k] * BLOCK + i];
        return;
    }
    const double *rows[BLOCK];
    for (int k = 0; k < (n_results + 3) / 4 * 4; k++)
        rows[k] = slots + results[k < n_results ? k : 0] * BLOCK;
    (vectors ? exchange_in_vectors : exchange)((double *)to, step / width, rows, n_results, n, 1);
}

/* A driver, whose table is a program. */
static intptr_t run_program(const void *table, char **starts, const intptr_t *dimensions, const intptr_t *steps)
{
    const int64_t *words = table, n_inputs = words[0], n_results = words[1], n_constants = words[2];
    const int64_t *sizes = words + 5, *results = sizes + n_inputs, *constants = results + n_results;
    const intptr_t n = dimensions[0];
    const int vectors = HAS_VECTORS();
    double *slots = malloc((size_t)words[4] * BLOCK * sizeof(double));
    if (slots == NULL)
        return 0;
    for (intptr_t start = 0; start < n; start += BLOCK) {
        const int count = n - start < BLOCK ? (int)(n - start) : BLOCK;
        const intptr_t *inner = steps + n_inputs + 1;
        double *slot = slots;
        for (int64_t p = 0; p < n_inputs; p++) {
            const intptr_t axis = sizes[p] ? *inner++ : 0;
            const int size = sizes[p] ? (int)sizes[p] : 1;
            if (steps[p] || !start)
                read_slots(
                    slot, starts[p] + start * steps[p], steps[p], axis, size, steps[p] ? count : 1,
                    start + count == n, vectors
                );
            slot += size * BLOCK;
        }
        if (!start)
            read_slots(slot, (const char *)constants, 0, sizeof(double), (int)n_constants, 1, 1, vectors);
        (vectors ? run_lines_in_vectors : run_lines_anywhere)(constants + n_constants, words[3], slots);
        char *to = starts[n_inputs] + start * steps[n_inputs];
        write_slots(
            to, steps[n_inputs], n_results > 1 ? *inner : (intptr_t)sizeof(double), slots, results, (int)n_results,
            count, vectors
        );
    }
    free(slots);
    return DONE;
}

/* A driver for one argument whose coefficients change signs; elements follow each other in memory. Its table has the
   number of coefficients, and the signs for a block of elements. */
static intptr_t change_signs(const void *table, char **starts, const intptr_t *dimensions, const intptr_t *steps)
{
    const intptr_t size = *(const int64_t *)table, step = size * (intptr_t)sizeof(double);
    const double *signs = (const double *)((const int64_t *)table + 1), *from = (const double *)starts[0];
    double *to = (double *)starts[1];
    const int vectors = HAS_VECTORS();
    if (steps[0] != step || steps[1] != step || steps[2] != (intptr_t)sizeof(double))
        return 0;
    for (intptr_t start = 0; start < dimensions[0]; start += BLOCK) {
        const intptr_t n = size * (dimensions[0] - start < BLOCK ? dimensions[0] - start : BLOCK);
        (vectors ? multiply_in_vectors : multiply_anywhere)(to, from, signs, n);
        from += n;
        to += n;
    }
    return DONE;
}

/* Axes of nested loops over a batch, the innermost first. */
typedef struct {
    int n_axes;
    Py_ssize_t lengths[MAX_LEADING];
    intptr_t strides[MAX_ARRAYS][MAX_LEADING];
} Rows;

/* A row of at least this many elements is not replaced by a longer one with larger strides. */
#define LONG_ROW 64

/* Whether the last axes of an array are those of an element, and its leading axes broadcast with those of the batch by
   numpy's rules. The axes of the batch are updated. */
static int take_axes(Batch *batch, const Array *array, const Shape *shape)
{
    const int n_axes = array->n_axes - shape->n_axes;
    if (n_axes < 0 || n_axes > MAX_LEADING)
        return 0;
    for (int k = 0; k < shape->n_axes; k++)
        if (array->shape[n_axes + k] != shape->axes[k])
            return 0;
    for (; batch->n_axes < n_axes; batch->n_axes++)
        batch->axes[MAX_LEADING - 1 - batch->n_axes] = 1;
    Py_ssize_t *axes = batch->axes + MAX_LEADING - n_axes;
    for (int k = 0; k < n_axes; k++) {
        if (axes[k] == 1)
            axes[k] = array->shape[k];
        else if (array->shape[k] != 1 && array->shape[k] != axes[k])
            return 0;
    }
    return 1;
}

/* Sets the address and strides of an array; strides are 0 along axes that are missing or have length 1. */
static void take_array(Batch *batch, int p, const Array *array, const Shape *shape)
{
    const int n_axes = array->n_axes - shape->n_axes;
    intptr_t *strides = batch->strides[p] + MAX_LEADING - n_axes;
    batch->starts[p] = array->data;
    for (int k = n_axes; k < batch->n_axes; k++)
        batch->strides[p][MAX_LEADING - 1 - k] = 0;
    for (int k = 0; k < n_axes; k++)
        strides[k] = array->shape[k] == 1 ? 0 : array->strides[k];
    for (int k = 0; k < shape->n_axes; k++)
        *batch->inner++ = array->strides[n_axes + k];
}

static void take_once(Batch *batch, int p, char *start)
{
    batch->starts[p] = start;
    for (int k = 0; k < batch->n_axes; k++)
        batch->strides[p][MAX_LEADING - 1 - k] = 0;
}

/* Computes the axes of a batch, with neighbouring axes merged if the strides of all arrays allow it. */
static void take_rows(const Batch *batch, int n_arrays, Rows *rows)
{
    rows->n_axes = 0;
    for (int k = MAX_LEADING; k-- > MAX_LEADING - batch->n_axes;) {
        const int last = rows->n_axes - 1;
        int joined = last >= 0;
        if (batch->axes[k] == 1)
            continue;
        for (int p = 0; p < n_arrays && joined; p++)
            joined = batch->strides[p][k] == rows->strides[p][last] * rows->lengths[last];
        if (joined) {
            rows->lengths[last] *= batch->axes[k];
            continue;
        }
        for (int p = 0; p < n_arrays; p++)
            rows->strides[p][rows->n_axes] = batch->strides[p][k];
        rows->lengths[rows->n_axes++] = batch->axes[k];
    }
    int longest = 0;
    for (int k = 1; k < rows->n_axes; k++)
        longest = rows->lengths[k] > rows->lengths[longest] ? k : longest;
    if (longest == 0 || rows->lengths[0] >= LONG_ROW)
        return;
    const Py_ssize_t length = rows->lengths[0];
    rows->lengths[0] = rows->lengths[longest];
    rows->lengths[longest] = length;
    for (int p = 0; p < n_arrays; p++) {
        const intptr_t stride = rows->strides[p][0];
        rows->strides[p][0] = rows->strides[p][longest];
        rows->strides[p][longest] = stride;
    }
}

/* Computes the first and last address of an array. */
static void bounds(const Array *array, Py_ssize_t width, char **first, char **last)
{
    *first = array->data;
    *last = array->data + width;
    for (int k = 0; k < array->n_axes; k++) {
        const Py_ssize_t reach = (array->shape[k] - 1) * array->strides[k];
        *(reach < 0 ? first : last) += reach;
    }
}

/* Whether a result may be written in place: no input overlaps with it, except an input that is the same array, whose
   elements are read before they are overwritten. */
static int is_apart(const Array *out, int n_leading, const Call *call, PyObject *const *inputs, Py_ssize_t width)
{
    char *first, *last, *begin, *end;
    bounds(out, width, &first, &last);
    for (int k = 0; k < call->n_inputs; k++) {
        if (Py_TYPE(inputs[k]) != array_type ||
            ((const Array *)inputs[k] == out && out->n_axes == n_leading + call->shapes[k].n_axes))
            continue;
        bounds((const Array *)inputs[k], width, &begin, &end);
        if (begin < last && first < end)
            return 0;
    }
    return 1;
}

/* Whether an input is a value with the layout of an argument; Python converts or refuses values of other layouts. */
static inline int has_layout(const Call *call, int k, PyObject *input)
{
    return call->layouts != NULL && is_value(input) && ((Value *)input)->kind->layout != NULL &&
           ((Value *)input)->kind->layout == PyTuple_GET_ITEM(call->layouts, k) && call->shapes[k].n_axes == 1 &&
           (((Value *)input)->kind->is_unit || !(call->units >> k & 1));
}

/* Takes the inputs of a batch. Python returns batches of elements, where all arguments with coefficients are values. */
static int take_inputs(Batch *batch, const Call *call, PyObject *const *args, int is_out)
{
    int n_values = 0;
    for (int k = 0; k < call->n_inputs; k++) {
        const Array *array = (const Array *)args[k];
        if (Py_TYPE(args[k]) != array_type)
            continue;
        if (batch->dtype == NULL)
            batch->dtype = real_type(array);
        if (batch->dtype == NULL || real_type(array) != batch->dtype || !(array->flags & ALIGNED) ||
            !take_axes(batch, array, &call->shapes[k]))
            return 0;
    }
    for (int k = 0; k < call->n_inputs && batch->dtype == NULL; k++)
        if (Py_TYPE(args[k]) == single_type)
            batch->dtype = float_type;
    if (batch->dtype == NULL)
        return 0;
    batch->width = batch->dtype == double_type ? sizeof(double) : sizeof(float);
    for (int k = 0; k < call->n_inputs; k++) {
        const Shape *shape = &call->shapes[k];
        PyObject *input = args[k];
        double number;
        if (Py_TYPE(input) == array_type) {
            take_array(batch, k, (const Array *)input, shape);
        } else if (!shape->n_axes && (is_number(input, &number) || is_single(input, &number))) {
            /* Python numbers take the dtype of the arrays; numpy scalars have their own. */
            if (batch->dtype == double_type)
                batch->numbers[k].f64 = number;
            else if (Py_TYPE(input) != number_type)
                batch->numbers[k].f32 = (float)number;
            else
                return 0;
            take_once(batch, k, (char *)&batch->numbers[k]);
        } else if (batch->dtype == double_type && has_layout(call, k, input)) {
            take_once(batch, k, (char *)((Value *)input)->x);
            *batch->inner++ = sizeof(double);
            n_values++;
        } else {
            return 0;
        }
    }
    return is_out || !n_values || n_values != call->n_elements;
}

/* Whether a result may be written to an array: it has the axes of the batch, and no input overlaps with it. */
static int take_out(Batch *batch, const Call *call, PyObject *const *args, PyObject *out)
{
    const Array *array = (const Array *)out;
    const Shape *shape = &call->shapes[call->n_inputs];
    const int usable = ALIGNED | WRITEABLE;
    if (call->n_outputs != 1 || Py_TYPE(out) != array_type || real_type(array) != batch->dtype ||
        (array->flags & usable) != usable || array->n_axes != batch->n_axes + shape->n_axes)
        return 0;
    memcpy(batch->axes + MAX_LEADING, shape->axes, (size_t)shape->n_axes * sizeof(Py_ssize_t));
    for (int k = 0; k < array->n_axes; k++)
        if (array->shape[k] != batch->axes[MAX_LEADING - batch->n_axes + k])
            return 0;
    if (!is_apart(array, batch->n_axes, call, args, batch->width))
        return 0;
    take_array(batch, call->n_inputs, array, shape);
    return 1;
}

static PyObject *new_result(Batch *batch, const Shape *shape)
{
    memcpy(batch->axes + MAX_LEADING, shape->axes, (size_t)shape->n_axes * sizeof(Py_ssize_t));
    return new_array(
        array_type, Py_NewRef(batch->dtype), batch->n_axes + shape->n_axes, batch->axes + MAX_LEADING - batch->n_axes,
        NULL, NULL, 0, NULL
    );
}

/* Runs the batch; if it returns 0, nothing was written. */
static int run(const Call *call, Batch *batch, Py_ssize_t size)
{
    const Way way = call->ways[batch->dtype == float_type]; /* Others may bind without the GIL. */
    const int n_arrays = call->n_inputs + call->n_outputs;
    Py_ssize_t places[MAX_LEADING] = {0};
    Rows rows;
    take_rows(batch, n_arrays, &rows);
    const intptr_t dimensions[] = {rows.n_axes ? rows.lengths[0] : 1};
    for (int p = 0; p < n_arrays; p++)
        batch->steps[p] = rows.n_axes ? rows.strides[p][0] : 0;
    PyThreadState *state = size > call->patience ? PyEval_SaveThread() : NULL;
    int done = 1;
    for (int k = 0; k < rows.n_axes || k == 0;) {
        /* All rows use the same loop, so that it can be missing only for the first. */
        done = go(&way, batch->starts, dimensions, batch->steps);
        if (!done)
            break;
        for (k = 1; k < rows.n_axes; k++) {
            const int more = ++places[k] < rows.lengths[k];
            for (int p = 0; p < n_arrays; p++)
                batch->starts[p] += more ? rows.strides[p][k] : -(rows.lengths[k] - 1) * rows.strides[p][k];
            if (more)
                break;
            places[k] = 0;
        }
    }
    if (state != NULL)
        PyEval_RestoreThread(state);
    return done;
}

/* The return value of a call: the only result, or a tuple of all results. If the call failed, results are released. */
static inline PyObject *returned(PyObject **made, int n, int done)
{
    if (n == 1 && done)
        return made[0];
    PyObject *tuple = done ? PyTuple_New(n) : NULL;
    for (int k = 0; k < n; k++) {
        if (tuple != NULL)
            PyTuple_SET_ITEM(tuple, k, made[k]);
        else
            Py_XDECREF(made[k]);
    }
    return tuple;
}

/* Whether batches run on one thread: the module's `num_threads` is 1. */
static int is_one_thread(PyObject *settings)
{
    PyObject *number = settings == NULL ? NULL : PyDict_GetItemWithError(settings, word_num_threads);
    return number != NULL && PyLong_CheckExact(number) && PyLong_AsLong(number) == 1;
}

/* The results of a batch, row by row; NULL without an error if the call has to be handled in Python. */
static PyObject *call_on_batch(const Call *call, PyObject *const *args, PyObject *out)
{
    Batch batch;
    const int n_inputs = call->n_inputs;
    const Shape *shapes = call->shapes + n_inputs;
    PyObject *made[MAX_ARRAYS];
    Number results[MAX_ARRAYS];
    Py_ssize_t size = 1;
    batch.dtype = NULL;
    batch.n_axes = 0;
    batch.inner = batch.steps + n_inputs + call->n_outputs;
    if (!take_inputs(&batch, call, args, out != NULL))
        return NULL;
    for (int k = MAX_LEADING - batch.n_axes; k < MAX_LEADING; k++)
        size *= batch.axes[k];
    if (size == 0 || (out != NULL && !take_out(&batch, call, args, out)))
        return NULL;
    if (size > call->most && !is_one_thread(call->settings)) {
        Rows rows;
        take_rows(&batch, n_inputs + (out != NULL), &rows);
        if (rows.n_axes < 2 || rows.lengths[0] > call->most)
            return NULL;
    }
    if (out != NULL)
        return run(call, &batch, size) ? Py_NewRef(out) : NULL;
    for (int k = 0; k < call->n_outputs; k++) {
        made[k] = NULL;
        if (!batch.n_axes && !shapes[k].n_axes) {
            take_once(&batch, n_inputs + k, (char *)&results[k]);
            continue;
        }
        made[k] = new_result(&batch, &shapes[k]);
        if (made[k] == NULL) {
            while (k--)
                Py_XDECREF(made[k]);
            return NULL;
        }
        take_array(&batch, n_inputs + k, (const Array *)made[k], &shapes[k]);
    }
    int done = run(call, &batch, size);
    for (int k = 0; k < call->n_outputs && done; k++) {
        if (made[k] == NULL)
            made[k] = batch.dtype == double_type ? new_number(results[k].f64) : new_single(results[k].f32);
        done = made[k] != NULL;
    }
    return returned(made, call->n_outputs, done);
}

/* Calls: the base class of kernel objects. */

static PyObject *call_in_python(PyObject *self, PyObject *const *args, size_t nargsf, PyObject *names)
{
    const Py_ssize_t n = PyVectorcall_NARGS(nargsf) + (names == NULL ? 0 : PyTuple_GET_SIZE(names));
    PyObject *few[MAX_ARRAYS];
    PyObject **all = n + 1 <= MAX_ARRAYS ? few : PyMem_Malloc((size_t)(n + 1) * sizeof(PyObject *));
    if (all == NULL)
        return PyErr_NoMemory();
    all[0] = self;
    memcpy(all + 1, args, (size_t)n * sizeof(PyObject *));
    PyObject *result = PyObject_VectorcallMethod(
        word_in_python, all, (size_t)PyVectorcall_NARGS(nargsf) + 1, names
    );
    if (all != few)
        PyMem_Free(all);
    return result;
}

static PyObject *new_dense(const Shape *shape)
{
    return new_array(array_type, Py_NewRef(double_type), shape->n_axes, shape->axes, NULL, NULL, 0, NULL);
}

/* Runs the kernel on one element of doubles, given its arrays, those of its results, and its numbers. Returns whether
   it was run. */
static inline int apply(const Call *call, double **arrays, double *numbers)
{
    if (call->function != NULL) {
        call->invoke(call->function, arrays, numbers);
        return 1;
    }
    const intptr_t dimensions[] = {1};
    char *starts[MAX_ARRAYS];
    for (int k = 0; k < call->n_inputs + call->n_outputs; k++) {
        const int is_array = k >= call->n_inputs || call->shapes[k].n_axes;
        starts[k] = is_array ? (char *)*arrays++ : (char *)numbers++;
    }
    return go(&call->ways[0], starts, dimensions, call->steps);
}

/* The types of results for arguments of one kind of objects; NULL if Python has not told them yet. */
static inline const Family *family_of(const Call *call, const PyObject *operate)
{
    for (int k = 0; k < call->n_families; k++)
        if (call->families[k].operate == operate)
            return &call->families[k];
    return NULL;
}

/* The results for one element of doubles in C order; NULL without an error for other arguments. They are values if all
   arguments with coefficients are. */
static PyObject *call_on_element(const Call *call, PyObject *const *args, PyObject *out)
{
    double *arrays[MAX_ARRAYS];
    double numbers[MAX_ARRAYS], results[MAX_ARRAYS];
    int n_arrays = 0, n_numbers = 0, n_values = 0;
    const PyObject *operate = NULL;
    const Family *family = NULL;
    for (int k = 0; k < call->n_inputs; k++) {
        const Shape *shape = &call->shapes[k];
        PyObject *input = args[k];
        if (is_dense(input, shape, IN_C_ORDER | ALIGNED)) {
            double *data = (double *)((Array *)input)->data;
            if (shape->n_axes)
                arrays[n_arrays++] = data;
            else
                numbers[n_numbers++] = *data;
        } else if (!shape->n_axes && is_number(input, &numbers[n_numbers])) {
            n_numbers++;
        } else if (has_layout(call, k, input)) {
            arrays[n_arrays++] = ((Value *)input)->x;
            operate = ((Value *)input)->kind->operate;
            n_values++;
        } else {
            return NULL;
        }
    }
    if (n_values && n_values == call->n_elements && out == NULL && (family = family_of(call, operate)) == NULL)
        return NULL;
    const Shape *shapes = call->shapes + call->n_inputs;
    if (out != NULL) {
        if (call->n_outputs != 1 || !shapes->n_axes || !is_dense(out, shapes, IN_C_ORDER | ALIGNED | WRITEABLE))
            return NULL;
        arrays[n_arrays] = (double *)((Array *)out)->data;
        return apply(call, arrays, numbers) ? Py_NewRef(out) : NULL;
    }
    PyObject *made[MAX_ARRAYS];
    for (int k = 0; k < call->n_outputs; k++) {
        Kind *kind = family == NULL ? NULL : family->kinds[k];
        made[k] = NULL;
        if (shapes[k].n_axes) {
            made[k] = kind == NULL ? new_dense(&shapes[k]) : (PyObject *)new_value(kind);
            if (made[k] == NULL) {
                while (k--)
                    Py_XDECREF(made[k]);
                return NULL;
            }
        }
        arrays[n_arrays++] = made[k] == NULL ? &results[k]
                             : kind == NULL ? (double *)((Array *)made[k])->data : ((Value *)made[k])->x;
    }
    int done = apply(call, arrays, numbers);
    for (int k = 0; k < call->n_outputs && done; k++)
        if (made[k] == NULL)
            done = (made[k] = new_number(results[k])) != NULL;
    return returned(made, call->n_outputs, done);
}

static PyObject *call_vectorcall(PyObject *self, PyObject *const *args, size_t nargsf, PyObject *names)
{
    const Call *call = (const Call *)self;
    PyObject *out = NULL;
    if (!call->n_inputs || PyVectorcall_NARGS(nargsf) != call->n_inputs)
        return call_in_python(self, args, nargsf, names);
    if (names != NULL) {
        if (PyTuple_GET_SIZE(names) != 1 || PyTuple_GET_ITEM(names, 0) != word_out)
            return call_in_python(self, args, nargsf, names);
        out = args[call->n_inputs] == Py_None ? NULL : args[call->n_inputs];
    }
    PyObject *result = call_on_element(call, args, out);
    if (result == NULL && !PyErr_Occurred())
        result = call_on_batch(call, args, out);
    if (result == NULL && !PyErr_Occurred())
        result = call_in_python(self, args, nargsf, names);
    return result;
}

PyDoc_STRVAR(
    attempt_doc,
    "attempt(*arrays)\n--\n\n"
    "Return the results for arrays that the extension reads directly, such as doubles in C order.\n"
    "Return None for all other arguments, valid or not, and before the kernel is first called."
);

static PyObject *call_attempt(PyObject *self, PyObject *const *args, Py_ssize_t n)
{
    const Call *call = (const Call *)self;
    PyObject *result = NULL;
    if (call->n_inputs && n == call->n_inputs) {
        result = call_on_element(call, args, NULL);
        if (result == NULL && !PyErr_Occurred())
            result = call_on_batch(call, args, NULL);
    }
    if (result == NULL && !PyErr_Occurred())
        Py_RETURN_NONE;
    return result;
}

static PyObject *call_new(PyTypeObject *type, PyObject *Py_UNUSED(args), PyObject *Py_UNUSED(names))
{
    Call *call = (Call *)type->tp_alloc(type, 0);
    if (call != NULL)
        call->vectorcall = call_vectorcall;
    return (PyObject *)call;
}

static int read_shape(PyObject *tuple, Shape *shape)
{
    if (!PyTuple_Check(tuple) || PyTuple_GET_SIZE(tuple) > MAX_AXES)
        return 0;
    shape->n_axes = (int)PyTuple_GET_SIZE(tuple);
    for (int k = 0; k < shape->n_axes; k++) {
        shape->axes[k] = PyLong_AsSsize_t(PyTuple_GET_ITEM(tuple, k));
        if (shape->axes[k] < 0) {
            PyErr_Clear();
            return 0;
        }
    }
    return 1;
}

PyDoc_STRVAR(
    bind_doc,
    "_bind(inputs, outputs, function, ways, most, patience, settings, layouts, units)\n--\n\n"
    "Let calls on elements of these shapes run the kernel at these addresses. Return False if it has too many arrays.\n"
    "`ways` has, for doubles and for floats, a loop, or a driver and its table; missing addresses are 0. `layouts`\n"
    "has that of each argument, None for numbers, and `units` has a bit for each argument of unit norm."
);

static PyObject *call_bind(PyObject *self, PyObject *args)
{
    Call *call = (Call *)self;
    unsigned long long function, ways[2][3];
    Py_ssize_t most, patience;
    PyObject *inputs, *outputs, *settings = NULL, *layouts = NULL;
    unsigned units = 0;
    if (!PyArg_ParseTuple(
            args, "O!O!K((KKK)(KKK))nn|O!O!I", &PyTuple_Type, &inputs, &PyTuple_Type, &outputs, &function, &ways[0][0],
            &ways[0][1], &ways[0][2], &ways[1][0], &ways[1][1], &ways[1][2], &most, &patience,
            &PyDict_Type, &settings, &PyTuple_Type, &layouts, &units
        ))
        return NULL;
    const Py_ssize_t n_inputs = PyTuple_GET_SIZE(inputs), n_outputs = PyTuple_GET_SIZE(outputs);
    if (new_array == NULL || n_inputs + n_outputs > MAX_ARRAYS)
        Py_RETURN_FALSE;
    char kinds[MAX_ARRAYS + 1] = "";
    for (Py_ssize_t k = 0; k < n_inputs + n_outputs; k++) {
        PyObject *shape = k < n_inputs ? PyTuple_GET_ITEM(inputs, k) : PyTuple_GET_ITEM(outputs, k - n_inputs);
        if (!read_shape(shape, &call->shapes[k]))
            Py_RETURN_FALSE;
        kinds[k] = k < n_inputs ? (call->shapes[k].n_axes ? 'a' : 'n') : 'r';
    }
    intptr_t *steps = call->steps + n_inputs + n_outputs;
    for (Py_ssize_t k = 0; k < n_inputs + n_outputs; k++) {
        const Shape *shape = &call->shapes[k];
        intptr_t step = sizeof(double);
        for (int axis = shape->n_axes; axis-- > 0; step *= shape->axes[axis])
            steps[axis] = step;
        steps += shape->n_axes;
    }
    call->n_outputs = (int)n_outputs;
    call->most = most;
    call->settings = settings;
    call->layouts = layouts != NULL && PyTuple_GET_SIZE(layouts) == n_inputs ? layouts : NULL;
    call->units = units;
    call->n_elements = 0;
    for (Py_ssize_t k = 0; call->layouts != NULL && k < n_inputs; k++)
        call->n_elements += PyTuple_GET_ITEM(layouts, k) != Py_None;
    call->patience = patience;
    for (size_t k = 0; k < sizeof(INVOKERS) / sizeof(INVOKERS[0]); k++)
        if (strcmp(INVOKERS[k].kinds, kinds) == 0) {
            call->invoke = INVOKERS[k].invoke;
            call->function = (Function)(uintptr_t)function;
        }
    for (int k = 0; k < 2; k++) {
        call->ways[k].loop = (Loop)(uintptr_t)ways[k][0];
        call->ways[k].driver = (Driver)(uintptr_t)ways[k][1];
        call->ways[k].table = (const void *)(uintptr_t)ways[k][2];
    }
    call->n_inputs = (int)n_inputs;
    Py_RETURN_TRUE;
}

PyDoc_STRVAR(
    bind_results_doc,
    "_bind_results(like, types)\n--\n\n"
    "Let calls whose arguments with coefficients are values of the kind of `like` return values of these types, which\n"
    "must outlive the kernel; None for results that are arrays or numbers."
);

static PyObject *call_bind_results(PyObject *self, PyObject *args)
{
    Call *call = (Call *)self;
    PyObject *like, *types;
    if (!PyArg_ParseTuple(args, "OO!", &like, &PyTuple_Type, &types))
        return NULL;
    const Py_ssize_t n = PyTuple_GET_SIZE(types);
    if (!is_value(like) || call->n_families == MAX_FAMILIES || n != call->n_outputs || !call->n_inputs)
        Py_RETURN_FALSE;
    Family family = {((Value *)like)->kind->operate, {NULL}};
    if (family_of(call, family.operate) != NULL)
        Py_RETURN_FALSE;
    for (Py_ssize_t k = 0; k < n; k++) {
        PyObject *type = PyTuple_GET_ITEM(types, k);
        if (type == Py_None)
            continue;
        family.kinds[k] = kind_of((PyTypeObject *)type);
        if (family.kinds[k] == NULL)
            return NULL;
        const Shape *shape = &call->shapes[call->n_inputs + k];
        if (shape->n_axes != 1 || shape->axes[0] != family.kinds[k]->size)
            Py_RETURN_FALSE;
    }
    call->families[call->n_families++] = family;
    Py_RETURN_TRUE;
}

PyDoc_STRVAR(
    adopt_call_doc,
    "_adopt()\n--\n\nEnable vectorcall for objects of this class; Python 3.12 and later do so by themselves."
);

static PyObject *call_adopt(PyObject *cls, PyObject *Py_UNUSED(args))
{
    PyTypeObject *type = (PyTypeObject *)cls;
    if (type->tp_call == PyVectorcall_Call && type->tp_vectorcall_offset == (Py_ssize_t)offsetof(Call, vectorcall)) {
        type->tp_flags |= Py_TPFLAGS_HAVE_VECTORCALL;
        PyType_Modified(type);
    }
    Py_RETURN_NONE;
}

static void call_dealloc(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    type->tp_free(self);
    Py_DECREF(type);
}

static PyMethodDef call_methods[] = {
    {"_adopt", call_adopt, METH_NOARGS | METH_CLASS, adopt_call_doc},
    {"_bind", call_bind, METH_VARARGS, bind_doc},
    {"_bind_results", call_bind_results, METH_VARARGS, bind_results_doc},
    {"attempt", (PyCFunction)(void (*)(void))call_attempt, METH_FASTCALL, attempt_doc},
    {NULL, NULL, 0, NULL},
};

static PyMemberDef call_members[] = {
    {"__vectorcalloffset__", T_PYSSIZET, offsetof(Call, vectorcall), READONLY, NULL},
    {NULL, 0, 0, 0, NULL},
};

static PyType_Slot call_slots[] = {
    {Py_tp_doc, "A kernel that is called on one element or on a batch."},
    {Py_tp_new, call_new},
    {Py_tp_dealloc, call_dealloc},
    {Py_tp_call, PyVectorcall_Call},
    {Py_tp_methods, call_methods},
    {Py_tp_members, call_members},
    {0, NULL},
};

static PyType_Spec call_spec = {
    "calls.Call",
    sizeof(Call),
    0,
    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_VECTORCALL,
    call_slots,
};

/* Kernels with loops: the lengths of their arrays are inferred in each call. */

#define MAX_LENGTHS 16
#define MAX_GIVEN 64 /* Arguments and results. */
#define MAX_TABLES 128
#define MAX_TABLE_AXES 6
#define MAX_FEW 512
#define MAX_OPERATIONS 32

/* A loop over elements of one dtype, compiled by C or numba; nonzero if memory cannot be allocated. */
typedef int (*RowsFunction)(const intptr_t *lengths, char **starts, const intptr_t *steps, intptr_t count);

/* An array of a kernel with loops; an axis is a number, or -1 - k for the length k. */
typedef struct {
    int n_axes;
    Py_ssize_t axes[MAX_TABLE_AXES];
    int is_index; /* Whether this is an index table. */
    int into; /* The length that limits its entries. */
    int least; /* The smallest valid entry, -1 or 0. */
    int earlier; /* Whether each entry must be less than the index of its row. */
} Table;

/* Operations of an element: a count for every combination of rows of some lengths. */
typedef struct {
    Py_ssize_t count;
    int n_lengths;
    int lengths[MAX_TABLE_AXES];
} Operations;

/* A kernel with loops, some of whose arguments may be fixed. */
typedef struct {
    PyObject_HEAD
    vectorcallfunc vectorcall;
    RowsFunction rows[2]; /* For doubles and for floats; NULL until the kernel can be run. */
    PyObject *settings; /* Settings of the module, borrowed; `backend` is their backend when this was bound. */
    PyObject *backend;
    int n_lengths;
    int n_inputs;
    int n_given; /* Inputs that are not fixed. */
    int n_outputs;
    int n_work;
    int only; /* Index of the only result that calls return, or -1 for all. */
    int transposed; /* Whether its last two axes are swapped. */
    Py_ssize_t lengths[MAX_LENGTHS]; /* Lengths of fixed arguments, or -1. */
    PyObject *fixed[MAX_GIVEN];
    int places[MAX_GIVEN]; /* Indices of the inputs that are not fixed. */
    int n_checked, checked[MAX_GIVEN]; /* Index tables whose entries are checked in a call. */
    char *starts[MAX_GIVEN]; /* Addresses of fixed inputs, with their sizes and the total of these. */
    Py_ssize_t sizes[MAX_GIVEN], total;
    Table tables[MAX_TABLES];
    int n_operations;
    Operations operations[MAX_OPERATIONS];
} LoopCall;

/* Work of a call (bytes, and four for each operation) from which the GIL is released, and from which several threads
   share a batch if the module's `num_threads` is greater than 1, as in Python. */
#define LONG_WORK (1 << 19)
#define SHARED_WORK (1 << 23)

/* Whether the axes of an array after those of a batch match a table; unknown lengths are inferred from them. */
static inline int take_lengths(const Py_ssize_t *shape, const Table *table, Py_ssize_t *lengths)
{
    for (int k = 0; k < table->n_axes; k++) {
        Py_ssize_t expected = table->axes[k];
        if (expected < 0) {
            Py_ssize_t *length = &lengths[-1 - expected];
            if (*length < 0)
                *length = shape[k];
            expected = *length;
        }
        if (shape[k] != expected)
            return 0;
    }
    return 1;
}

/* Sets the shape of a table and returns its size. */
static inline Py_ssize_t table_axes(const Table *table, const Py_ssize_t *lengths, Py_ssize_t *axes)
{
    Py_ssize_t size = 1;
    for (int k = 0; k < table->n_axes; k++) {
        axes[k] = table->axes[k] < 0 ? lengths[-1 - table->axes[k]] : table->axes[k];
        size *= axes[k];
    }
    return size;
}

/* Whether an object is a contiguous array of 64-bit integers with the axes of a table. */
static inline int is_index_array(PyObject *object, const Table *table)
{
    const Array *array = (const Array *)object;
    const int usable = IN_C_ORDER | ALIGNED;
    if (Py_TYPE(object) != array_type || array->n_axes != table->n_axes || (array->flags & usable) != usable)
        return 0;
    const DataType *type = (const DataType *)array->dtype;
    return type->order == '=' && type->kind == 'i' &&
           ((type->letter == 'l' && sizeof(long) == 8) || type->letter == 'q');
}

/* Whether all entries of an index table are valid. */
static inline int names_rows(const int64_t *index, Py_ssize_t n, const Table *table, const Py_ssize_t *lengths)
{
    const Py_ssize_t count = lengths[table->into];
    for (Py_ssize_t k = 0; k < n; k++)
        if (index[k] < table->least || index[k] >= (table->earlier && k < count ? k : count))
            return 0;
    return 1;
}

/* Whether n bytes and m bytes do not overlap. */
static int are_apart(const char *a, Py_ssize_t n, const char *b, Py_ssize_t m)
{
    return a + n <= b || b + m <= a;
}

/* The elements of a batch: axes, number of elements, and bytes from one element to the next in each array. */
typedef struct {
    int n_axes;
    const Py_ssize_t *axes;
    Py_ssize_t count;
    intptr_t steps[MAX_TABLES];
} Elements;

static const intptr_t no_steps[MAX_TABLES];

/* Matches the leading axes of an array with those of the batch, which must be the same in all arrays that have any;
   other broadcasting is handled in Python. `steps` are set once an array with leading axes is found. */
static inline int take_leading(Elements *elements, const Array *array, int n_axes)
{
    if (n_axes > MAX_LEADING)
        return 0;
    if (!elements->n_axes) {
        elements->n_axes = n_axes;
        elements->axes = array->shape;
        elements->count = 1;
        for (int k = 0; k < n_axes; k++)
            elements->count *= array->shape[k];
        memset(elements->steps, 0, sizeof elements->steps);
        return elements->count > 0;
    }
    return elements->n_axes == n_axes && !memcmp(elements->axes, array->shape, (size_t)n_axes * sizeof *elements->axes);
}

/* A new array for a result, contiguous in C order, and its address; or the array with its last two axes swapped. */
static PyObject *new_rows(PyObject *type, const Elements *elements, int n_axes, const Py_ssize_t *core, int transposed,
    char **start)
{
    enum { IN_FORTRAN_ORDER = 2, MOST_AXES = MAX_LEADING + MAX_TABLE_AXES };
    Py_ssize_t axes[MOST_AXES], strides[MOST_AXES];
    const int n = elements->n_axes + n_axes, is_matrix = n == 2 && n_axes == 2;
    for (int k = 0; k < n; k++)
        axes[k] = k < elements->n_axes ? elements->axes[k] : core[k - elements->n_axes];
    if (transposed && is_matrix) {
        axes[0] = core[1];
        axes[1] = core[0];
    }
    /* Without strides, the flags select a memory order. */
    PyObject *made = new_array(
        array_type, Py_NewRef(type), n, axes, NULL, NULL, transposed && is_matrix ? IN_FORTRAN_ORDER : 0, NULL
    );
    if (made == NULL)
        return NULL;
    const Array *array = (const Array *)made;
    *start = array->data;
    if (!transposed || is_matrix)
        return made;
    memcpy(strides, array->strides, (size_t)n * sizeof *strides);
    axes[n - 1] = core[n_axes - 2];
    axes[n - 2] = core[n_axes - 1];
    strides[n - 1] = array->strides[n - 2];
    strides[n - 2] = array->strides[n - 1];
    PyObject *view = new_array(
        array_type, Py_NewRef(type), n, axes, strides, array->data, ALIGNED | WRITEABLE, NULL
    );
    if (view == NULL)
        Py_DECREF(made);
    else
        ((Array *)view)->base = made;
    return view;
}

/* The work for one element, as in `LoopDefinition.work_of`. */
static double work_of(const LoopCall *call, const Py_ssize_t *lengths, Py_ssize_t bytes)
{
    double work = (double)bytes;
    for (int k = 0; k < call->n_operations; k++) {
        const Operations *some = &call->operations[k];
        double count = 4.0 * (double)some->count;
        for (int axis = 0; axis < some->n_lengths; axis++)
            count *= (double)lengths[some->lengths[axis]];
        work += count;
    }
    return work;
}

/* Runs elements, releasing the GIL if they take long; returns 0 if a batch needs several threads, or on failure. */
static int run_elements(const LoopCall *call, RowsFunction rows, const Py_ssize_t *lengths, char **starts,
    const Elements *elements, double work)
{
    const intptr_t *steps = elements->n_axes ? elements->steps : no_steps;
    work *= (double)elements->count;
    if (work < LONG_WORK)
        return rows((const intptr_t *)lengths, starts, steps, elements->count) == 0;
    if (work >= SHARED_WORK && elements->n_axes && !is_one_thread(call->settings))
        return 0;
    int failed;
    Py_BEGIN_ALLOW_THREADS
    failed = rows((const intptr_t *)lengths, starts, steps, elements->count);
    Py_END_ALLOW_THREADS
    return !failed;
}

/* The results for doubles or floats in C order, of one element or a batch; NULL without an error if Python has to
   handle them. */
static PyObject *loops_on_arrays(const LoopCall *call, PyObject *const *args, PyObject *out)
{
    Py_ssize_t lengths[MAX_LENGTHS], axes[MAX_TABLE_AXES], sizes[MAX_GIVEN];
    double numbers[MAX_GIVEN], few[MAX_FEW];
    Number results[MAX_GIVEN];
    char *starts[MAX_TABLES];
    PyObject *made[MAX_GIVEN], *type = NULL;
    Py_ssize_t total = call->total, n_room = 0, width = sizeof(double);
    int singles = 0, doubles = 0; /* Whether numbers have a precision of their own. */
    Elements elements;
    elements.n_axes = 0;
    elements.count = 1;
    if (call->settings != NULL && PyDict_GetItemWithError(call->settings, word_backend) != call->backend)
        return NULL;
    memcpy(lengths, call->lengths, sizeof lengths);
    memcpy(starts, call->starts, (size_t)call->n_inputs * sizeof *starts);
    memcpy(sizes, call->sizes, (size_t)call->n_inputs * sizeof *sizes);
    for (int given = 0; given < call->n_given; given++) {
        const int k = call->places[given];
        const Table *table = &call->tables[k];
        PyObject *input = args[given];
        const Array *array = (const Array *)input;
        int before = 0;
        if (table->is_index) {
            if (!is_index_array(input, table))
                return NULL;
        } else if (Py_TYPE(input) == array_type) {
            const int usable = IN_C_ORDER | ALIGNED;
            PyObject *own = real_type(array);
            if (own == NULL || (type != NULL && own != type) || (array->flags & usable) != usable)
                return NULL;
            type = own;
            width = type == double_type ? sizeof(double) : sizeof(float);
            before = array->n_axes - table->n_axes;
            if (before && (before < 0 || !take_leading(&elements, array, before)))
                return NULL;
        } else if (!table->n_axes && (is_number(input, &numbers[k]) || is_single(input, &numbers[k]))) {
            singles |= Py_TYPE(input) == single_type;
            doubles |= Py_TYPE(input) == number_type || Py_TYPE(input) == scalar_type;
            starts[k] = (char *)&numbers[k];
            sizes[k] = 0;
            continue;
        } else {
            return NULL;
        }
        if (!take_lengths(array->shape + before, table, lengths))
            return NULL;
        starts[k] = array->data;
        total += sizes[k] = table_axes(table, lengths, axes);
        if (before) {
            elements.steps[k] = width * sizes[k];
            sizes[k] *= elements.count;
        }
    }
    if (type == NULL)
        type = double_type;
    const int is_double = type == double_type;
    const RowsFunction rows = call->rows[!is_double];
    if (rows == NULL || (is_double ? singles : doubles))
        return NULL;
    for (int k = 0; k < call->n_inputs && !is_double; k++)
        if (starts[k] == (char *)&numbers[k]) {
            const float number = (float)numbers[k];
            memcpy(&numbers[k], &number, sizeof number);
        }
    for (int k = 0; k < call->n_checked; k++) {
        const Table *table = &call->tables[call->checked[k]];
        const int64_t *index = (const int64_t *)starts[call->checked[k]];
        if (!names_rows(index, lengths[-1 - table->axes[0]], table, lengths))
            return NULL;
    }
    const Table *outputs = call->tables + call->n_inputs, *work = outputs + call->n_outputs;
    const int is_tuple = out != NULL && PyTuple_CheckExact(out);
    if (out != NULL && (call->only >= 0 || (is_tuple ? PyTuple_GET_SIZE(out) : 1) != call->n_outputs ||
                        is_tuple != (call->n_outputs > 1)))
        return NULL;
    for (int k = 0; k < call->n_outputs && out != NULL; k++) {
        const Table *table = &outputs[k];
        PyObject *target = is_tuple ? PyTuple_GET_ITEM(out, k) : out;
        const Array *array = (const Array *)target;
        const int usable = IN_C_ORDER | ALIGNED | WRITEABLE, at = call->n_inputs + k;
        if (table->n_axes + elements.n_axes == 0 || Py_TYPE(target) != array_type || real_type(array) != type ||
            (array->flags & usable) != usable || array->n_axes != table->n_axes + elements.n_axes ||
            (elements.n_axes && !take_leading(&elements, array, elements.n_axes)) ||
            !take_lengths(array->shape + elements.n_axes, table, lengths))
            return NULL;
        const Py_ssize_t size = table_axes(table, lengths, axes);
        starts[at] = array->data;
        sizes[at] = size * elements.count;
        for (int other = 0; other < at; other++) {
            const Py_ssize_t wide = call->tables[other].is_index ? (Py_ssize_t)sizeof(int64_t) : width;
            if (sizes[other] && !are_apart(array->data, sizes[at] * width, starts[other], sizes[other] * wide))
                return NULL;
        }
        total += size;
        if (elements.n_axes)
            elements.steps[at] = width * size;
    }
    /* Memory for intermediate tables, and for results that are not returned. */
    for (int k = 0; k < call->n_work; k++)
        n_room += table_axes(&work[k], lengths, axes);
    for (int k = 0; call->only >= 0 && k < call->n_outputs; k++)
        n_room += k == call->only ? 0 : table_axes(&outputs[k], lengths, axes);
    /* numpy asks for large pages, which take a part of the time to be mapped. */
    PyObject *room = n_room <= MAX_FEW
        ? NULL : new_array(array_type, Py_NewRef(type), 1, &n_room, NULL, NULL, 0, NULL);
    if (room == NULL && n_room > MAX_FEW)
        return NULL;
    char *next = room == NULL ? (char *)few : ((Array *)room)->data;
    for (int k = 0; k < call->n_work; k++) {
        starts[call->n_inputs + call->n_outputs + k] = next;
        next += width * table_axes(&work[k], lengths, axes);
    }
    int done = 1, n_made = 0;
    for (int k = 0; out == NULL && k < call->n_outputs && done; k++) {
        const Table *table = &outputs[k];
        char **start = &starts[call->n_inputs + k];
        const Py_ssize_t size = table_axes(table, lengths, axes);
        total += size;
        if (call->only >= 0 && k != call->only) {
            *start = next;
            next += width * size;
            continue;
        }
        made[n_made] = NULL;
        *start = (char *)&results[n_made];
        if (table->n_axes + elements.n_axes) {
            made[n_made] = new_rows(type, &elements, table->n_axes, axes, call->transposed, start);
            done = made[n_made] != NULL;
        }
        if (elements.n_axes)
            elements.steps[call->n_inputs + k] = width * size;
        n_made++;
    }
    if (done)
        done = run_elements(call, rows, lengths, starts, &elements, work_of(call, lengths, total * width));
    Py_XDECREF(room);
    if (out != NULL)
        return done ? Py_NewRef(out) : NULL;
    for (int k = 0; k < n_made && done; k++)
        if (made[k] == NULL)
            done = (made[k] = is_double ? new_number(results[k].f64) : new_single(results[k].f32)) != NULL;
    return returned(made, n_made, done);
}

static PyObject *loops_attempt(PyObject *self, PyObject *const *args, Py_ssize_t n)
{
    const LoopCall *call = (const LoopCall *)self;
    PyObject *result = NULL;
    if ((call->rows[0] != NULL || call->rows[1] != NULL) && n == call->n_given)
        result = loops_on_arrays(call, args, NULL);
    if (result == NULL && !PyErr_Occurred())
        Py_RETURN_NONE;
    return result;
}

static PyObject *loops_vectorcall(PyObject *self, PyObject *const *args, size_t nargsf, PyObject *names)
{
    LoopCall *call = (LoopCall *)self;
    PyObject *out = NULL;
    if ((call->rows[0] == NULL && call->rows[1] == NULL) || PyVectorcall_NARGS(nargsf) != call->n_given)
        return call_in_python(self, args, nargsf, names);
    if (names != NULL) {
        if (PyTuple_GET_SIZE(names) != 1 || PyTuple_GET_ITEM(names, 0) != word_out)
            return call_in_python(self, args, nargsf, names);
        out = args[call->n_given] == Py_None ? NULL : args[call->n_given];
    }
    PyObject *result = loops_on_arrays(call, args, out);
    if (result == NULL && !PyErr_Occurred())
        result = call_in_python(self, args, nargsf, names);
    return result;
}

static PyObject *loops_new(PyTypeObject *type, PyObject *Py_UNUSED(args), PyObject *Py_UNUSED(names))
{
    LoopCall *call = (LoopCall *)type->tp_alloc(type, 0);
    if (call != NULL)
        call->vectorcall = loops_vectorcall;
    return (PyObject *)call;
}

static int read_table(PyObject *object, Table *table, int n_lengths)
{
    PyObject *axes;
    if (!PyArg_ParseTuple(
            object, "O!iiii", &PyTuple_Type, &axes, &table->is_index, &table->into, &table->least, &table->earlier
        ) ||
        PyTuple_GET_SIZE(axes) > MAX_TABLE_AXES || (table->is_index && table->into >= n_lengths))
        return 0;
    table->n_axes = (int)PyTuple_GET_SIZE(axes);
    for (int k = 0; k < table->n_axes; k++) {
        table->axes[k] = PyLong_AsSsize_t(PyTuple_GET_ITEM(axes, k));
        if (table->axes[k] < -n_lengths)
            return 0;
    }
    return 1;
}

static int read_operations(PyObject *object, Operations *operations, int n_lengths)
{
    PyObject *lengths;
    if (!PyArg_ParseTuple(object, "nO!", &operations->count, &PyTuple_Type, &lengths) ||
        PyTuple_GET_SIZE(lengths) > MAX_TABLE_AXES)
        return 0;
    operations->n_lengths = (int)PyTuple_GET_SIZE(lengths);
    for (int k = 0; k < operations->n_lengths; k++) {
        operations->lengths[k] = (int)PyLong_AsLong(PyTuple_GET_ITEM(lengths, k));
        if (operations->lengths[k] < 0 || operations->lengths[k] >= n_lengths)
            return 0;
    }
    return 1;
}

PyDoc_STRVAR(
    bind_loops_doc,
    "_bind(addresses, lengths, tables, n_inputs, n_outputs, fixed, operations, only, transposed, settings)\n--\n\n"
    "Let calls run the kernel at the addresses for doubles and for floats, of which 0 is left to Python. Return False\n"
    "if it has too many arrays. Lengths are -1 if calls determine them. Tables are (axes, is_index, into, least,\n"
    "earlier). Fixed arguments are arrays, and None for the others. Operations are (count, lengths). `only` is the\n"
    "index of the only result that calls return, or -1 for all."
);

static PyObject *loops_bind(PyObject *self, PyObject *args)
{
    LoopCall *call = (LoopCall *)self;
    unsigned long long addresses[2];
    int n_inputs, n_outputs, only, transposed;
    PyObject *known, *tables, *fixed, *operations, *settings;
    if (!PyArg_ParseTuple(
            args, "(KK)O!O!iiO!O!ipO!", &addresses[0], &addresses[1], &PyTuple_Type, &known, &PyTuple_Type, &tables,
            &n_inputs, &n_outputs, &PyTuple_Type, &fixed, &PyTuple_Type, &operations, &only, &transposed,
            &PyDict_Type, &settings
        ))
        return NULL;
    const Py_ssize_t n_tables = PyTuple_GET_SIZE(tables);
    const int n_lengths = (int)PyTuple_GET_SIZE(known);
    if (new_array == NULL || n_tables > MAX_TABLES || n_inputs + n_outputs > MAX_GIVEN || n_lengths > MAX_LENGTHS ||
        n_inputs + n_outputs > n_tables || PyTuple_GET_SIZE(fixed) != n_inputs || only >= n_outputs ||
        PyTuple_GET_SIZE(operations) > MAX_OPERATIONS)
        Py_RETURN_FALSE;
    call->rows[0] = call->rows[1] = NULL;
    call->n_operations = (int)PyTuple_GET_SIZE(operations);
    for (int k = 0; k < call->n_operations; k++)
        if (!read_operations(PyTuple_GET_ITEM(operations, k), &call->operations[k], n_lengths)) {
            if (PyErr_Occurred())
                return NULL;
            Py_RETURN_FALSE;
        }
    for (Py_ssize_t k = 0; k < n_tables; k++)
        if (!read_table(PyTuple_GET_ITEM(tables, k), &call->tables[k], n_lengths)) {
            if (PyErr_Occurred())
                return NULL;
            Py_RETURN_FALSE;
        }
    for (int k = 0; k < MAX_LENGTHS; k++) {
        call->lengths[k] = k < n_lengths ? PyLong_AsSsize_t(PyTuple_GET_ITEM(known, k)) : -1;
        if (PyErr_Occurred())
            return NULL;
    }
    call->n_given = call->n_checked = 0;
    for (int k = 0; k < n_inputs; k++) {
        PyObject *object = PyTuple_GET_ITEM(fixed, k);
        if (object == Py_None) {
            Py_CLEAR(call->fixed[k]);
            call->places[call->n_given++] = k;
            continue;
        }
        const Array *array = (const Array *)object;
        if (Py_TYPE(object) != array_type || (array->flags & (IN_C_ORDER | ALIGNED)) != (IN_C_ORDER | ALIGNED) ||
            array->n_axes != call->tables[k].n_axes || !take_lengths(array->shape, &call->tables[k], call->lengths))
            Py_RETURN_FALSE;
        Py_XSETREF(call->fixed[k], Py_NewRef(object));
        call->starts[k] = array->data;
    }
    call->total = 0;
    for (int k = 0; k < n_inputs; k++) {
        /* Fixed tables were checked already, except against lengths that are known only in a call. */
        const Table *table = &call->tables[k];
        Py_ssize_t axes[MAX_TABLE_AXES];
        if (table->is_index && (call->fixed[k] == NULL || call->lengths[table->into] < 0))
            call->checked[call->n_checked++] = k;
        if (call->fixed[k] != NULL)
            call->total += call->sizes[k] = table_axes(table, call->lengths, axes);
    }
    PyObject *backend = PyDict_GetItemWithError(settings, word_backend);
    if (backend == NULL)
        Py_RETURN_FALSE;
    Py_XSETREF(call->backend, Py_NewRef(backend));
    call->settings = settings;
    call->n_lengths = n_lengths;
    call->n_inputs = n_inputs;
    call->n_outputs = n_outputs;
    call->n_work = (int)n_tables - n_inputs - n_outputs;
    call->only = only;
    call->transposed = transposed;
    for (int k = 0; k < 2; k++)
        call->rows[k] = (RowsFunction)(uintptr_t)addresses[k];
    Py_RETURN_TRUE;
}

static PyObject *loops_adopt(PyObject *cls, PyObject *Py_UNUSED(args))
{
    PyTypeObject *type = (PyTypeObject *)cls;
    if (type->tp_call == PyVectorcall_Call &&
        type->tp_vectorcall_offset == (Py_ssize_t)offsetof(LoopCall, vectorcall)) {
        type->tp_flags |= Py_TPFLAGS_HAVE_VECTORCALL;
        PyType_Modified(type);
    }
    Py_RETURN_NONE;
}

static void loops_dealloc(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    LoopCall *call = (LoopCall *)self;
    for (int k = 0; k < MAX_GIVEN; k++)
        Py_CLEAR(call->fixed[k]);
    Py_CLEAR(call->backend);
    type->tp_free(self);
    Py_DECREF(type);
}

static PyMethodDef loops_methods[] = {
    {"_adopt", loops_adopt, METH_NOARGS | METH_CLASS, adopt_call_doc},
    {"_bind", loops_bind, METH_VARARGS, bind_loops_doc},
    {"attempt", (PyCFunction)(void (*)(void))loops_attempt, METH_FASTCALL, attempt_doc},
    {NULL, NULL, 0, NULL},
};

static PyMemberDef loops_members[] = {
    {"__vectorcalloffset__", T_PYSSIZET, offsetof(LoopCall, vectorcall), READONLY, NULL},
    {NULL, 0, 0, 0, NULL},
};

static PyType_Slot loops_slots[] = {
    {Py_tp_doc, "A kernel with loops that is called on one element or on a batch."},
    {Py_tp_new, loops_new},
    {Py_tp_dealloc, loops_dealloc},
    {Py_tp_call, PyVectorcall_Call},
    {Py_tp_methods, loops_methods},
    {Py_tp_members, loops_members},
    {0, NULL},
};

static PyType_Spec loops_spec = {
    "calls.LoopCall",
    sizeof(LoopCall),
    0,
    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_VECTORCALL,
    loops_slots,
};

/* The module. */

PyDoc_STRVAR(
    prepare_doc,
    "prepare(array, address, shape, strides, flags, number, single, functions)\n--\n\n"
    "Read numpy's types from an array, a double, and 1.5 in single precision, and return whether their memory layout\n"
    "is as expected."
);

static PyObject *prepare(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *object, *number, *single, *functions;
    unsigned long long address;
    Py_ssize_t rows, columns, row_step, column_step;
    int flags;
    if (!PyArg_ParseTuple(
            args, "OK(nn)(nn)iOOO", &object, &address, &rows, &columns, &row_step, &column_step, &flags, &number,
            &single, &functions
        ))
        return NULL;
    const Array *array = (const Array *)object;
    void **table = PyCapsule_GetPointer(functions, NULL);
    if (table == NULL)
        return NULL;
    const unsigned version = ((unsigned (*)(void))table[VERSION_FUNCTION])() >> 24;
    if ((version != 1 && version != 2) || Py_TYPE(object)->tp_basicsize < (Py_ssize_t)sizeof(Array) ||
        (uintptr_t)array->data != (uintptr_t)address || array->n_axes != 2 || array->shape[0] != rows ||
        array->shape[1] != columns || array->strides[0] != row_step || array->strides[1] != column_step ||
        array->flags != flags || !PyFloat_Check(number) ||
        Py_TYPE(number)->tp_basicsize != PyFloat_Type.tp_basicsize)
        Py_RETURN_FALSE;
    if (Py_TYPE(single)->tp_basicsize < (Py_ssize_t)sizeof(Single) || ((Single *)single)->value != 1.5f)
        Py_RETURN_FALSE;
    PyObject *dtype = PyObject_GetAttrString(object, "dtype");
    PyObject *small = dtype == NULL ? NULL : PyObject_GetAttrString(single, "dtype");
    const DataType *types[] = {(const DataType *)dtype, (const DataType *)small};
    const int known = small != NULL && dtype == array->dtype && Py_TYPE(dtype) != Py_TYPE(small) &&
                      types[0]->order == '=' && types[1]->order == '=' && types[0]->letter == 'd' &&
                      types[1]->letter == 'f';
    if (known && new_array == NULL) {
        array_type = (PyTypeObject *)Py_NewRef(Py_TYPE(object));
        number_type = (PyTypeObject *)Py_NewRef(Py_TYPE(number));
        single_type = (PyTypeObject *)Py_NewRef(Py_TYPE(single));
        double_type = Py_NewRef(dtype);
        float_type = Py_NewRef(small);
        new_array = (NewArray)table[NEW_FUNCTION];
    }
    Py_XDECREF(dtype);
    Py_XDECREF(small);
    return PyErr_Occurred() ? NULL : PyBool_FromLong(known);
}

static PyMethodDef methods[] = {
    {"prepare", prepare, METH_VARARGS, prepare_doc},
    {"bind_operator", bind_operator, METH_VARARGS, bind_operator_doc},
    {"set_number", set_number, METH_VARARGS, set_number_doc},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT, "calls", "Fast calls of kernels, and values.", -1, methods, NULL, NULL, NULL, NULL,
};

/* The name contains a digest of this text, which is known only when it is compiled. */
PyMODINIT_FUNC INIT(void)
{
    static const char *const texts[] = {BINARY(TEXT) "()", "**", UNARY(TEXT) POWERS(TEXT)};
    PyObject *module = PyModule_Create(&definition);
    PyObject *call = PyType_FromSpec(&call_spec), *value = PyType_FromSpec(&value_spec);
    PyObject *loops = PyType_FromSpec(&loops_spec), *drivers = Py_BuildValue(
        "(KK)", (unsigned long long)(uintptr_t)run_program, (unsigned long long)(uintptr_t)change_signs
    );
    int failed = module == NULL || call == NULL || value == NULL || loops == NULL || drivers == NULL ||
                 PyModule_AddObjectRef(module, "Call", call) < 0 ||
                 PyModule_AddObjectRef(module, "LoopCall", loops) < 0 ||
                 PyModule_AddObjectRef(module, "Value", value) < 0 ||
                 PyModule_AddStringConstant(module, "operations", OPERATIONS(OPERATION_NAME)) < 0 ||
                 PyModule_AddObjectRef(module, "drivers", drivers) < 0;
    failed = failed || (word_out = PyUnicode_InternFromString("out")) == NULL ||
             (word_in_python = PyUnicode_InternFromString("_in_python")) == NULL ||
             (word_backend = PyUnicode_InternFromString("backend")) == NULL ||
             (word_num_threads = PyUnicode_InternFromString("num_threads")) == NULL ||
             (word_power = PyUnicode_InternFromString("__pow__")) == NULL ||
             (word_reflected_power = PyUnicode_InternFromString("__rpow__")) == NULL ||
             (word_kind = PyUnicode_InternFromString("_kind")) == NULL ||
             (word_equals = PyUnicode_InternFromString("_equals")) == NULL ||
             (word_hash = PyUnicode_InternFromString("_hash")) == NULL;
    for (int k = 0; k < N_SYMBOLS && !failed; k++)
        failed = (symbols[k] = PyUnicode_InternFromString(texts[k])) == NULL;
    Py_XDECREF(call);
    Py_XDECREF(value);
    Py_XDECREF(loops);
    Py_XDECREF(drivers);
    if (failed)
        Py_CLEAR(module);
    return module;
}

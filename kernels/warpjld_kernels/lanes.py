"""C++ for arithmetic on several numbers at once, one source for the CPU and for a GPU.

On the CPU ``Doubles`` and ``Floats`` are vectors that the compiler spreads over registers; on a GPU they are single
numbers. ``N`` is how many numbers they hold, so that ``for (int base = 0; base < lanes; base += N)`` takes all lanes on
either.

| word | meaning |
|---|---|
| ``Stored`` | floats in an array, as a pointer's target: they need not be aligned |
| ``PICK(x, l)`` | lane l of x |
| ``LOWEST(x, y)``, ``HIGHEST(x, y)`` | lane by lane |
| ``WIDENED(x)`` | floats as doubles |
| ``LANES_OF(test)`` | bits of the lanes in which a comparison holds |
| ``FIRST_OF(bits)`` | number of the lowest bit set |
"""

VECTORISED = {
    "enable_backward": False,
    "cpu_compiler_flags": "-march=native -ffp-contract=fast -mprefer-vector-width=512",
}
"""Options of a module whose loops are to fill the CPU's vector registers."""


EIGHT = """
#ifdef __CUDACC__
    struct Eight {
        double n[8];
        CUDA_CALLABLE Eight(double all = 0.0) { for (double& one : n) one = all; }
        CUDA_CALLABLE double& operator[](int k) { return n[k]; }
        CUDA_CALLABLE double operator[](int k) const { return n[k]; }
        CUDA_CALLABLE Eight& operator+=(const Eight& o) { for (int k = 0; k < 8; ++k) n[k] += o.n[k]; return *this; }
        CUDA_CALLABLE Eight& operator-=(const Eight& o) { for (int k = 0; k < 8; ++k) n[k] -= o.n[k]; return *this; }
        CUDA_CALLABLE Eight& operator*=(const Eight& o) { for (int k = 0; k < 8; ++k) n[k] *= o.n[k]; return *this; }
        CUDA_CALLABLE Eight& operator/=(const Eight& o) { for (int k = 0; k < 8; ++k) n[k] /= o.n[k]; return *this; }
        CUDA_CALLABLE Eight operator+(const Eight& o) const { Eight out = *this; return out += o; }
        CUDA_CALLABLE Eight operator-(const Eight& o) const { Eight out = *this; return out -= o; }
        CUDA_CALLABLE Eight operator*(const Eight& o) const { Eight out = *this; return out *= o; }
        CUDA_CALLABLE Eight operator/(const Eight& o) const { Eight out = *this; return out /= o; }
    };
    typedef Eight Loose;
#else
    typedef double Eight __attribute__((ext_vector_type(8)));
    typedef double Loose __attribute__((ext_vector_type(8), aligned(8)));
#endif
"""
"""Eight doubles of one thread, ``Eight``, and the same as a pointer's target that need not be aligned, ``Loose``: a
vector on the CPU, a struct on a GPU."""


def prelude(lanes: int) -> str:
    """C++ prelude of a native function's body: vector types and macros for ``lanes`` numbers."""
    return f"""
#if defined(__CUDA_ARCH__)
    typedef double Doubles;
    typedef float Floats;
    typedef float Stored;
    constexpr int N = 1;
#define PICK(x, l) (x)
#define LOWEST(x, y) ((x) < (y) ? (x) : (y))
#define HIGHEST(x, y) ((x) > (y) ? (x) : (y))
#define WIDENED(x) ((double)(x))
#define LANES_OF(test) ((test) ? 1u : 0u)
#define FIRST_OF(bits) (__ffs(bits) - 1)
#else
    typedef double Doubles __attribute__((ext_vector_type({lanes})));
    typedef float Floats __attribute__((ext_vector_type({lanes})));
    typedef float Stored __attribute__((ext_vector_type({lanes}), aligned(4)));
    typedef bool Bits __attribute__((ext_vector_type({lanes})));
    constexpr int N = {lanes};
#define PICK(x, l) (x)[l]
#define LOWEST(x, y) __builtin_elementwise_min(x, y)
#define HIGHEST(x, y) __builtin_elementwise_max(x, y)
#define WIDENED(x) __builtin_convertvector(x, Doubles)
#define LANES_OF(test) (unsigned int)__builtin_bit_cast(uint{lanes}_t, __builtin_convertvector(test, Bits))
#define FIRST_OF(bits) __builtin_ctz(bits)
#endif
"""

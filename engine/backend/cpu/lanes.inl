// lanes.inl: a vector register of numbers, with which laws compute as with one; a part of
// passes.inl. Its width depends on the instruction set, and no result on its width.

#if defined(__AVX512F__)
inline constexpr int vector_bytes = 64;
#elif defined(__AVX2__)
inline constexpr int vector_bytes = 32;
#else
inline constexpr int vector_bytes = 16;
#endif

template <class R>
struct lanes {
    static constexpr int count = vector_bytes / int(sizeof(R));
    typedef R vector_type __attribute__((vector_size(vector_bytes)));
    vector_type v;

    lanes() = default;
    LIMAX_LAW lanes(vector_type values) : v(values) {}
    // The same number in all lanes; -0 too, which adding to 0 would lose.
    LIMAX_LAW explicit lanes(double number) : v(R(number) - vector_type{}) {}

    LIMAX_LAW friend lanes operator-(lanes a) { return -a.v; }
    LIMAX_LAW friend lanes operator+(lanes a, lanes b) { return a.v + b.v; }
    LIMAX_LAW friend lanes operator-(lanes a, lanes b) { return a.v - b.v; }
    LIMAX_LAW friend lanes operator*(lanes a, lanes b) { return a.v * b.v; }
};

using limax::fma;
using limax::inverse_length;

template <class R>
LIMAX_LAW lanes<R> fma(lanes<R> a, lanes<R> b, lanes<R> c) {
#if defined(__AVX512F__)
    if constexpr (sizeof(R) == sizeof(float))
        return lanes<R>(_mm512_fmadd_ps(a.v, b.v, c.v));
    else
        return lanes<R>(_mm512_fmadd_pd(a.v, b.v, c.v));
#elif defined(__AVX2__)
    if constexpr (sizeof(R) == sizeof(float))
        return lanes<R>(_mm256_fmadd_ps(a.v, b.v, c.v));
    else
        return lanes<R>(_mm256_fmadd_pd(a.v, b.v, c.v));
#else
    for (int i = 0; i < lanes<R>::count; ++i) a.v[i] = fma(R(a.v[i]), R(b.v[i]), R(c.v[i]));
    return a;
#endif
}

template <class R>
LIMAX_LAW lanes<R> inverse_length(lanes<R> squared) {
    for (int i = 0; i < lanes<R>::count; ++i) squared.v[i] = square_root(R(squared.v[i]));
    return R(1) / squared.v;
}

// Numbers from memory, or to it, without any alignment.
template <class R, class Stored>
LIMAX_LAW lanes<R> load(const Stored* from) {
    typedef Stored anywhere
        __attribute__((vector_size(lanes<R>::count * sizeof(Stored)), aligned(4), may_alias));
    return __builtin_convertvector(*reinterpret_cast<const anywhere*>(from),
                                   typename lanes<R>::vector_type);
}
template <class R>
LIMAX_LAW void store(R* to, lanes<R> values) {
    typedef R anywhere __attribute__((vector_size(vector_bytes), aligned(4), may_alias));
    *reinterpret_cast<anywhere*>(to) = values.v;
}
template <class R>
LIMAX_LAW vector<lanes<R>> load(const R* const from[3], int64_t site) {
    return {load<R>(from[0] + site), load<R>(from[1] + site), load<R>(from[2] + site)};
}
template <class R>
LIMAX_LAW void store(R* const to[3], int64_t site, const vector<lanes<R>>& values) {
    store(to[0] + site, values.x);
    store(to[1] + site, values.y);
    store(to[2] + site, values.z);
}

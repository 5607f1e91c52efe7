// compile.cpp: reads the text of a scripted effect, by recursive descent, into a program. Nothing
// of the text reaches a compiler, a shell or a file.
#include <cmath>
#include <map>
#include <set>

#include "base/error.h"
#include "physics/scripted/program.h"
#include "physics/scripted/tokens.h"

namespace limax::scripted {

namespace {

constexpr int deepest = 100;  // nested brackets and signs, for the reader's own stack

// A number in the register of x, or a vector in all three.
struct value {
    bool vector = false;
    int16_t x = 0, y = 0, z = 0;
};

struct function {
    const char* name;
    operation what;
    int operands;
};
// Functions of numbers.
constexpr function functions[] = {
    {"sqrt", operation::root, 1},    {"sin", operation::sine, 1},
    {"cos", operation::cosine, 1},   {"exp", operation::exponential, 1},
    {"abs", operation::absolute, 1}, {"min", operation::smaller, 2},
    {"max", operation::larger, 2},
};

class reader : private token_reader {
public:
    reader(const std::string& place, const std::string& text,
           const std::vector<parameter>& parameters);
    program read();

private:
    void require_register() const {
        if (program_.constants.size() + steps_.size() >= std::size_t(most_registers))
            refuse_read(
                format("this law takes more than %d numbers and operations", most_registers));
    }
    int16_t constant(double number);
    int16_t emit(operation what, int16_t a, int16_t b = 0, int16_t c = 0);
    value number(operation what, value a, value b = {}, value c = {}) {
        return {false, emit(what, a.x, b.x, c.x), 0, 0};
    }
    // An operation on each component; a number stands for three.
    value each(operation what, value a, value b) {
        if (!a.vector) a.y = a.z = a.x;
        if (!b.vector) b.y = b.z = b.x;
        return {true, emit(what, a.x, b.x), emit(what, a.y, b.y), emit(what, a.z, b.z)};
    }
    value need_number(value v, const std::string& of) {
        if (v.vector) refuse_read(of + " takes numbers, not vectors");
        return v;
    }
    value need_vector(value v, const std::string& of) {
        if (!v.vector) refuse_read(of + " takes vectors, not numbers");
        return v;
    }

    void statement();
    value expression() { return choice(); }
    value choice();
    value disjunction();
    value conjunction();
    value comparison();
    value sum();
    value product();
    value signed_value();
    value component_of(value v);
    int16_t& component_here(value& v);
    value primary();
    value call(const std::string& name);
    value dot(value a, value b);

    int depth_ = 0;
    program program_;
    // numbered as by constant()
    std::vector<instruction> steps_;
    std::map<std::string, value> names_;
    std::set<std::string> fixed_;  // names that no statement may change
    std::set<std::string> own_words_;
};

// While reading, constants are numbered below 0 and results from `inputs` on.
int16_t reader::constant(double number) {
    require_register();
    program_.constants.push_back(number);
    return int16_t(-int(program_.constants.size()));
}

int16_t reader::emit(operation what, int16_t a, int16_t b, int16_t c) {
    require_register();
    steps_.push_back({what, a, b, c});
    return int16_t(inputs + int(steps_.size()) - 1);
}

reader::reader(const std::string& place, const std::string& text,
               const std::vector<parameter>& parameters)
    : token_reader(place, text) {
    names_ = {{"x", {true, input_position, input_position + 1, input_position + 2}},
              {"v", {true, input_velocity, input_velocity + 1, input_velocity + 2}},
              {"m", {false, input_mass}},
              {"t", {false, input_time}}};
    own_words_ = {"real", "f", "vec", "dot", "cross", "length"};
    for (const function& each : functions) own_words_.insert(each.name);
    const int16_t zero = constant(0);
    const auto refuse_input = [&](const std::string& problem) {
        fail(LIMAX_INVALID_ARGUMENT, place + ": " + problem);
    };
    for (const parameter& input : parameters) {
        const char* const name = input.name.c_str();
        if (!is_name(input.name))
            refuse_input(format("a parameter's name is letters, digits and _, not '%.60s'", name));
        if (names_.count(input.name) || own_words_.count(input.name))
            refuse_input(format("no parameter can be called '%s': the name is taken", name));
        if (input.components != 1 && input.components != 3)
            refuse_input(format("parameter '%s' has %d components; it must be 1 or 3", name,
                                input.components));
        value held{input.components == 3};
        int16_t* const components[3] = {&held.x, &held.y, &held.z};
        for (int c = 0; c < input.components; ++c) {
            if (!std::isfinite(input.value[c]))
                refuse_input(format("parameter '%s' is not finite", name));
            *components[c] = constant(input.value[c]);
        }
        names_[input.name] = held;
    }
    for (const auto& [name, _] : names_) fixed_.insert(name);
    names_["f"] = {true, zero, zero, zero};
    advance();
}

program reader::read() {
    bool sets_force = false;
    while (now_.kind != token::end) {
        sets_force = sets_force || (now_.kind == token::word && now_.text == "f");
        statement();
    }
    if (!sets_force) refuse("the text never sets the force f");
    const auto place_of = [&](int16_t at) -> int16_t {
        if (at < 0) return int16_t(inputs - 1 - at);
        return int16_t(at < inputs ? at : at + int(program_.constants.size()));
    };
    for (const instruction& step : steps_)
        program_.instructions.push_back(
            {step.what, place_of(step.a), place_of(step.b), place_of(step.c)});
    const value force = names_["f"];
    program_.force[0] = place_of(force.x);
    program_.force[1] = place_of(force.y);
    program_.force[2] = place_of(force.z);
    return std::move(program_);
}

// [vec|real] NAME [.x|.y|.z] (=|+=) expression ;
void reader::statement() {
    if (take(";")) return;
    if (now_.kind != token::word)
        refuse(format("expected a statement such as 'f = ...;', got %s", here().c_str()));
    std::string name = now_.text;
    advance();
    const bool makes = name == "vec" || name == "real";
    const bool as_vector = name == "vec";
    if (makes) {
        if (now_.kind != token::word) refuse(format("expected a name, got %s", here().c_str()));
        name = now_.text;
        if (names_.count(name) || own_words_.count(name))
            refuse(format("the name '%s' is taken", name.c_str()));
        advance();
    } else if (!names_.count(name)) {
        refuse_read(
            format("unknown name '%s'; a new one begins with 'real' or 'vec'", name.c_str()));
    } else if (fixed_.count(name)) {
        refuse_read(format("'%s' is an input and cannot be changed", name.c_str()));
    }
    value& target = names_[name];
    int16_t* component = nullptr;
    if (!makes && target.vector && take(".")) component = &component_here(target);
    const bool adds = !makes && at("+=");
    if (!adds && !at("="))
        refuse_read(format("expected '=' after '%s', got %s", name.c_str(), here().c_str()));
    // a name is not yet known within the statement that makes it
    value before = target;
    if (makes) names_.erase(name);
    advance();
    value result = expression();
    const bool wants_vector = makes ? as_vector : before.vector && !component;
    if (result.vector != wants_vector)
        refuse_read(format("'%s' is a %s; this is a %s", name.c_str(),
                           wants_vector ? "vector" : "number",
                           result.vector ? "vector" : "number"));
    if (component) {
        *component = adds ? emit(operation::add, *component, result.x) : result.x;
    } else {
        if (adds)
            result = before.vector ? each(operation::add, before, result)
                                   : number(operation::add, before, result);
        names_[name] = result;
    }
    if (now_.kind != token::end) need(";");
}

value reader::choice() {
    if (++depth_ > deepest) refuse(format("more than %d levels of brackets", deepest));
    value chosen = disjunction();
    if (take("?")) {
        const value condition = need_number(chosen, "?");
        const value yes = choice();
        need(":");
        const value no = choice();
        if (yes.vector != no.vector)
            refuse_read("both sides of ':' must be numbers, or both vectors");
        chosen = number(operation::choose, condition, yes, no);
        if (yes.vector)
            chosen = {true, chosen.x, emit(operation::choose, condition.x, yes.y, no.y),
                      emit(operation::choose, condition.x, yes.z, no.z)};
    }
    --depth_;
    return chosen;
}

value reader::disjunction() {
    value left = conjunction();
    while (take("||"))
        left = number(operation::either, need_number(left, "||"), need_number(conjunction(), "||"));
    return left;
}

value reader::conjunction() {
    value left = comparison();
    while (take("&&"))
        left = number(operation::both, need_number(left, "&&"), need_number(comparison(), "&&"));
    return left;
}

value reader::comparison() {
    const value left = sum();
    const std::string sign = now_.text;
    static const std::set<std::string> comparisons = {"<", ">", "<=", ">=", "==", "!="};
    if (!comparisons.count(sign)) return left;
    advance();
    const value right = need_number(sum(), sign);
    need_number(left, sign);
    if (sign == "<") return number(operation::less, left, right);
    if (sign == ">") return number(operation::less, right, left);
    if (sign == "<=") return number(operation::at_most, left, right);
    if (sign == ">=") return number(operation::at_most, right, left);
    const value same = number(operation::equal, left, right);
    return sign == "==" ? same : number(operation::inverted, same);
}

value reader::sum() {
    value left = product();
    while (at("+") || at("-")) {
        const operation what = at("+") ? operation::add : operation::subtract;
        advance();
        const value right = product();
        if (left.vector != right.vector)
            refuse_read("a number and a vector cannot be added or subtracted");
        left = left.vector ? each(what, left, right) : number(what, left, right);
    }
    return left;
}

value reader::product() {
    value left = signed_value();
    while (at("*") || at("/")) {
        const bool divides = at("/");
        advance();
        const value right = signed_value();
        if (divides && right.vector) refuse_read("nothing can be divided by a vector");
        if (left.vector && right.vector)
            refuse_read("two vectors cannot be multiplied by *; there are dot and cross");
        const operation what = divides ? operation::divide : operation::multiply;
        left = left.vector || right.vector ? each(what, left, right) : number(what, left, right);
    }
    return left;
}

value reader::signed_value() {
    if (++depth_ > deepest) refuse(format("more than %d levels of brackets", deepest));
    value result;
    if (take("-")) {
        result = signed_value();
        result = result.vector
                     ? value{true, emit(operation::negate, result.x),
                             emit(operation::negate, result.y), emit(operation::negate, result.z)}
                     : number(operation::negate, result);
    } else if (take("!")) {
        result = number(operation::inverted, need_number(signed_value(), "!"));
    } else {
        result = component_of(primary());
    }
    --depth_;
    return result;
}

value reader::component_of(value v) {
    if (!take(".")) return v;
    if (!v.vector) refuse_read("a number has no components");
    return {false, component_here(v), 0, 0};
}

int16_t& reader::component_here(value& v) {
    int16_t* const component = now_.text == "x"   ? &v.x
                               : now_.text == "y" ? &v.y
                               : now_.text == "z" ? &v.z
                                                  : nullptr;
    if (!component) refuse(format("a vector has x, y and z, not %s", here().c_str()));
    advance();
    return *component;
}

value reader::primary() {
    if (now_.kind == token::number) {
        const value result{false, constant(now_.number_value), 0, 0};
        advance();
        return result;
    }
    if (take("(")) {
        const value inside = expression();
        need(")");
        return inside;
    }
    if (now_.kind != token::word)
        refuse(format("expected a number, a name or '(', got %s", here().c_str()));
    const std::string name = now_.text;
    const auto found = names_.find(name);
    if (found != names_.end()) {
        advance();
        return found->second;
    }
    if (own_words_.count(name) && name != "real") {
        advance();
        return call(name);
    }
    std::string there, callable;
    for (const auto& [word, _] : names_) there += (there.empty() ? "" : ", ") + word;
    for (const std::string& word : own_words_)
        if (word != "real" && word != "f") callable += (callable.empty() ? "" : ", ") + word;
    refuse(format("unknown name '%s'; there are %s, and the functions %s", name.c_str(),
                  there.c_str(), callable.c_str()));
}

value reader::call(const std::string& name) {
    need("(");
    std::vector<value> arguments;
    do arguments.push_back(expression());
    while (take(","));
    need(")");
    const auto takes = [&](std::size_t count) {
        if (arguments.size() != count)
            refuse_read(format("%s takes %zu %s, not %zu", name.c_str(), count,
                               count == 1 ? "value" : "values", arguments.size()));
    };
    for (const function& candidate : functions) {
        if (name != candidate.name) continue;
        takes(std::size_t(candidate.operands));
        for (const value v : arguments) need_number(v, name);
        return number(candidate.what, arguments[0], arguments.size() > 1 ? arguments[1] : value{});
    }
    takes(name == "vec" ? 3 : name == "length" ? 1 : 2);
    if (name == "vec") {
        for (const value v : arguments) need_number(v, name);
        return {true, arguments[0].x, arguments[1].x, arguments[2].x};
    }
    for (const value v : arguments) need_vector(v, name);
    if (name == "length") return number(operation::root, dot(arguments[0], arguments[0]));
    if (name == "dot") return dot(arguments[0], arguments[1]);
    const value a = arguments[0], b = arguments[1];
    const auto minor = [&](int16_t p, int16_t q, int16_t r, int16_t s) {
        return emit(operation::subtract, emit(operation::multiply, p, q),
                    emit(operation::multiply, r, s));
    };
    return {true, minor(a.y, b.z, a.z, b.y), minor(a.z, b.x, a.x, b.z), minor(a.x, b.y, a.y, b.x)};
}

value reader::dot(value a, value b) {
    const int16_t first = emit(operation::add, emit(operation::multiply, a.x, b.x),
                               emit(operation::multiply, a.y, b.y));
    return {false, emit(operation::add, first, emit(operation::multiply, a.z, b.z)), 0, 0};
}

}  // namespace

program compile(const std::string& place, const std::string& text,
                const std::vector<parameter>& parameters) {
    return reader(place, text, parameters).read();
}

}  // namespace limax::scripted

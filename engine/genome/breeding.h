// breeding.h: the genes of a first generation and of children. Laws: each gene is a function of its
// own counter, so populations can be bred in any order and in any pieces. Includes only laws.
#pragma once

#include "base/random.h"
#include "genome/network.h"

namespace limax {

struct breeding_rates {
    double mutation_rate;   // chance of a gene to mutate
    double mutation_scale;  // standard deviation of a mutation
    double crossover_rate;  // chance of a gene to come from the second parent
};

// Every gene has two draws of its stream: one for choices, one for a normal deviate.
LIMAX_LAW uint32_t choice_draw(uint32_t gene) { return 2 * gene; }
LIMAX_LAW uint32_t deviate_draw(uint32_t gene) { return 2 * gene + 1; }

// Standard deviation of initial weights: the sums of a layer are about as large as its inputs,
// however many there are.
LIMAX_LAW double initial_deviation(double scale, int32_t inputs) {
    return scale / square_root(double(inputs));
}

// N(0, deviation^2), rounded once. `key` has the stream `initial`.
LIMAX_LAW float initial_gene(const random_key& key, uint32_t gene, double deviation) {
    return float(deviation * random_normal(key, deviate_draw(gene)));
}

// A gene of a first genome: weights by the inputs of their layer, biases 0, genes that belong to no
// layer N(0, scale^2), and then genes of control. `deviation` [layers + 2] is that of
// initial_deviations().
LIMAX_LAW float initial_gene(const network_shape& shape, const double* deviation,
                             const random_key& key, int32_t gene) {
    int32_t layer = 0, of_layer = gene;
    while (layer < shape.layers && of_layer >= shape.genes_of_layer(layer))
        of_layer -= shape.genes_of_layer(layer++);
    if (layer < shape.layers && of_layer >= shape.width[layer] * shape.width[layer + 1])
        return 0.0f;
    if (layer == shape.layers && of_layer >= shape.free_genes && deviation[++layer] == 0)
        return 0.0f;
    return initial_gene(key, uint32_t(gene), deviation[layer]);
}

// Standard deviations of the weights of each layer, of genes that belong to none and of genes of
// control.
LIMAX_LAW void initial_deviations(const network_shape& shape, double scale, double control_spread,
                                  double* deviation) {
    for (int32_t layer = 0; layer < shape.layers; ++layer)
        deviation[layer] = initial_deviation(scale, shape.width[layer]);
    deviation[shape.layers] = scale;
    deviation[shape.layers + 1] = control_spread;
}

// A gene of a child that is not an elite. `key` has the stream `breeding`, the child's generation
// and its index.
LIMAX_LAW float child_gene(const breeding_rates& rates, const random_key& key, uint32_t gene,
                           float of_first, float of_second) {
    const random_block choice = random_bits(key, choice_draw(gene));
    const double crossover = unit_interval(join_words(choice.word[0], choice.word[1]));
    const double mutation = unit_interval(join_words(choice.word[2], choice.word[3]));
    const float inherited = crossover < rates.crossover_rate ? of_second : of_first;
    // Most genes do not mutate, and a deviate costs more than all else here: a branch, whose sides
    // give what a select would. NaN is inherited as it is: the bits that arithmetic gives for it
    // differ between devices.
    if (!(mutation < rates.mutation_rate) || inherited != inherited) return inherited;
    return float(
        fma(rates.mutation_scale, random_normal(key, deviate_draw(gene)), double(inherited)));
}

}  // namespace limax

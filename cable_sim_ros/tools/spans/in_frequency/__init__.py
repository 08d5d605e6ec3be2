"""In the frequency domain: modes, damping, lift spectrum, response; Capozucca (1988), mended (docs/viv.md)."""

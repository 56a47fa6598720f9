"""Objects that nothing holds, as rigid bodies that fall, slide, roll and come to rest."""
